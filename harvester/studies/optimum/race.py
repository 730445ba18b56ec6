"""Several searches that share a budget, which begin with the same number of places each.

The places of the first scan come in rounds, coarse to fine: in a round each search evaluates one
more place, so that none is judged by fewer places than another.  A search whose scan shows less
than `HOPELESS` of the largest power ends there; the remainder of the budget is shared out among the
others, that of the largest power first.  A power that has not settled ends no other search.
"""

import time
from collections.abc import Mapping
from dataclasses import dataclass, field

from harvester.errors import HarvesterError
from harvester.machine.progress import NO_PROGRESS, NoProgress, Progress
from harvester.presentation.diagnostic import note, warning
from harvester.studies.optimum.evaluations import SHORTEST, SpentError
from harvester.studies.optimum.optimum_result import Optimum
from harvester.studies.optimum.ranges import scan
from harvester.studies.optimum.sampled_search import SCAN, SampledSearch
from harvester.studies.optimum.search import Search, SearchRequest
from harvester.studies.optimum.search_result import Peak, SearchResult
from harvester.studies.output_folder import OutputFolder

SCANS = 0.6  # of the whole budget, for the scans at most
HOPELESS = 0.5  # of the largest power: a scan may miss a peak's top, but not by as much


@dataclass
class Race:
    """The searches of several scenes by their names, with the seconds of all of them together."""

    requests: Mapping[str, SearchRequest]
    progress: Progress = NO_PROGRESS
    start: float = field(default_factory=time.perf_counter)
    searches: dict[str, Search] = field(default_factory=dict)
    scan_power: dict[str, float] = field(default_factory=dict)  # the largest power of each scan
    scanned: bool = False  # all scans are complete
    top: str = ""  # the search that has shown the largest sound power
    waiting: list[str] = field(default_factory=list)
    plan_reported: bool = False  # how many places the budget allows the scans

    @property
    def total_budget(self) -> float:
        """The seconds of all searches."""
        return sum(request.budget for request in self.requests.values())

    def order(self) -> list[str]:
        """Scan all searches alike; their names, in the order in which they continue."""
        for name, request in self.requests.items():
            self.searches[name] = search = Search.begin(request, _Elapsed(self))
            search.surface.budget = SCANS * self.total_budget
            search.surface.begin = self.start
        sampling = {
            name: s.sampled_search
            for name, s in self.searches.items()
            if s.sampled_search is not None
        }
        try:
            # a round: each has a place more
            while sum(scan_one_more(search) for search in sampling.values()):
                if not self.plan_reported:
                    self._report_plan()
            self.scanned = True
        except SpentError:
            pass  # all have the same places, but for one place
        self._compare(sampling)
        self.waiting = sorted(self.requests, key=lambda name: -self.scan_power.get(name, 0.0))
        return list(self.waiting)

    def _report_plan(self) -> None:
        """State the reach of the budget, once a round has shown the cost of a place, compilation included."""
        seconds = time.perf_counter() - self.start
        search = next(iter(self.searches.values()))
        size = SCAN[search.surface.dimensions]
        fit = min(int(SCANS * self.total_budget / seconds), size)
        plan = note("scan_fits", seconds=seconds, fit=fit, places=size, circuits=len(self.searches))
        self.progress.start(what=str(plan))
        self.plan_reported = True

    def _compare(self, searches: Mapping[str, SampledSearch]) -> None:
        """Note the largest power of each scan, and which has the largest of those that are sound."""
        sound = dict[str, float]()
        for name, search in searches.items():
            try:
                self.scan_power[name] = best_of_scan(search).power.value
                if any(evaluation.is_sound for evaluation in scanning(search).of_scan):
                    sound[name] = self.scan_power[name]
            except HarvesterError:
                self.scan_power[name] = 0.0  # its error comes again where it goes on
        self.top = max(sound or self.scan_power, key=self.scan_power.__getitem__, default="")

    def optimum(self, name: str, folder: OutputFolder | None) -> Optimum:
        """The result of a search in its share of the seconds that are left.

        ``folder`` gets its files.

        Raises HarvesterError if every place fails, the last error.
        """
        search = self.searches[name]
        surface = self.searches[name].surface
        going_on = [other for other in self.waiting if not self._hopeless(other)]
        self.waiting.remove(name)
        surface.begin, now = time.perf_counter(), time.perf_counter()
        surface.budget = max(self.start + self.total_budget - now, SHORTEST) / max(len(going_on), 1)
        result = None
        if search.sampled_search is not None and self._hopeless(name):
            word = warning(
                "ended_with_scan",
                share=self.scan_power[name] / self.scan_power[self.top],
                top=self.top,
            )
            result = SearchResult((best_of_scan(search.sampled_search),), warnings=(word,))
        return search.finish(folder, result)

    def _hopeless(self, name: str) -> bool:
        """Whether all were scanned, and this one has too little power to continue."""
        return self.scanned and 0.0 < self.scan_power.get(
            name, 0.0
        ) < HOPELESS * self.scan_power.get(self.top, 0.0)


@dataclass
class _Elapsed(NoProgress):
    """The progress of each search: the share of the seconds of all of them that has passed."""

    race: Race

    def step(self, done: float = 1, what: str = "") -> None:
        """Tell the progress of the race."""
        passed = time.perf_counter() - self.race.start
        self.race.progress.step(min(passed / self.race.total_budget, 1.0), what)


def scanning(search: SampledSearch) -> SampledSearch:
    """The search that makes the first scan: the scout's, if there is one."""
    return search.scout() or search


def scan_one_more(search: SampledSearch) -> bool:
    """Evaluate the next place of the coarse scan that a search begins with; False if it has all.

    Raises SpentError if the budget has ended.
    """
    first = scanning(search)
    dimensions = search.surface.dimensions
    done = len(first.of_scan)
    points = scan(SCAN[dimensions], dimensions)
    if done == len(points):
        return False
    search.surface.evaluate(points[done][None], first.coarse(first.scan_seed), "scan")
    return True


def best_of_scan(search: SampledSearch) -> Peak:
    """The place of the largest power that the coarse scan saw.

    Raises the last error if it saw none.
    """
    return search.best_so_far(scanning(search).of_scan)
