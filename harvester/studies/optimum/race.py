"""Several searches that share a budget, which begin with the same number of places each.

The places of the first scan come in rounds, coarse to fine: in a round each search evaluates one more place, so that
none is judged by fewer places than another.  A search whose scan shows less than `HOPELESS` of the largest power ends
there; what is left of the budget is shared out among the others, that of the largest power first.
"""

import time
from collections.abc import Mapping
from dataclasses import dataclass, field

from harvester.errors import HarvesterError
from harvester.studies.optimum.answer import Optimum
from harvester.studies.optimum.evaluations import SHORTEST, SpentError, Surface, Tick
from harvester.studies.optimum.optimise import SearchAsked, finished
from harvester.studies.optimum.ranges import scan
from harvester.studies.optimum.sampled_search import SCAN, SampledSearch
from harvester.studies.optimum.search_result import Peak, SearchResult
from harvester.studies.output_folder import OutputFolder

SCANS = 0.6  # of the whole budget, for the scans at most
ENDED = "its search ended with the first scan"  # the first words of the warning of one that did not go on
HOPELESS = 0.5  # of the largest power: a scan may miss a peak's top, but not by as much


@dataclass
class Race:
    """The searches of several scenes by their names, with the seconds of all of them together."""

    asked: Mapping[str, SearchAsked]
    tick: Tick | None = None
    begin: float = field(default_factory=time.perf_counter)
    surfaces: dict[str, Surface] = field(default_factory=dict)
    searches: dict[str, SampledSearch | None] = field(default_factory=dict)
    seen: dict[str, float] = field(default_factory=dict)  # the largest power of each complete scan
    waiting: list[str] = field(default_factory=list)

    @property
    def whole(self) -> float:
        """The seconds of all searches."""
        return sum(one.budget for one in self.asked.values())

    def order(self) -> list[str]:
        """Scan all searches alike; their names, in the order in which they go on."""
        for name, one in self.asked.items():
            surface = Surface(one.scene, one.ranges, SCANS * self.whole, self._told, begin=self.begin)
            self.surfaces[name], self.searches[name] = surface, one.search(surface)
        searches = {name: one for name, one in self.searches.items() if one is not None}
        try:
            more = bool(searches)
            while more:
                more = sum(scan_one_more(search) for search in searches.values()) > 0
            for name, search in searches.items():
                try:
                    self.seen[name] = best_of_scan(search).power.value
                except HarvesterError:
                    self.seen[name] = 0.0  # its error comes again where it goes on
        except SpentError:
            pass
        self.waiting = sorted(self.asked, key=lambda name: -self.seen.get(name, 0.0))
        return list(self.waiting)

    def optimum(self, name: str, folder: OutputFolder | None) -> Optimum:
        """What a search finds in its share of the seconds that are left; ``folder`` gets its files.

        Raises HarvesterError where every place fails, the last error.
        """
        surface, search = self.surfaces[name], self.searches[name]
        going_on = [one for one in self.waiting if not self._hopeless(one)]
        self.waiting.remove(name)
        surface.begin, now = time.perf_counter(), time.perf_counter()
        surface.budget = max(self.begin + self.whole - now, SHORTEST) / max(len(going_on), 1)
        found = None
        if search is not None and self._hopeless(name):
            top = max(self.seen, key=self.seen.__getitem__)
            word = f"{ENDED}, whose largest power is {self.seen[name] / self.seen[top]:.0%} of that of {top}"
            found = SearchResult((best_of_scan(search),), warnings=(word,))
        return finished(self.asked[name], surface, search, folder, found)

    def _hopeless(self, name: str) -> bool:
        """Whether all were scanned, and this one has too little power to go on."""
        top = max(self.seen.values(), default=0.0)
        return 0.0 < self.seen.get(name, 0.0) < HOPELESS * top

    def _told(self, _: float) -> None:
        if self.tick is not None:
            self.tick(min((time.perf_counter() - self.begin) / self.whole, 1.0))


def scan_one_more(search: SampledSearch) -> bool:
    """Evaluate the next place of the coarse scan that a search begins with; False where it has all.

    Raises SpentError where the budget has ended.
    """
    first, dimensions = search.scout() or search, search.surface.dimensions
    done, places = len(first.of_scan), scan(SCAN[dimensions], dimensions)
    if done == len(places):
        return False
    search.surface.evaluate(places[done][None], first.coarse(first.scan_seed), "scan")
    return True


def best_of_scan(search: SampledSearch) -> Peak:
    """The place of the largest power that the coarse scan saw; raises the last error where it saw none."""
    first = search.scout() or search
    return search.so_far(first.of_scan)
