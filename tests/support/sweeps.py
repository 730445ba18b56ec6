"""A sweep as tests ask for it, and who writes down what it hears."""

import harvester as hv
from harvester.machine.progress import CallingBack


def swept(scene, vary, engines=None, **execution):
    """A sweep with an execution of these fields."""
    return hv.sweep(scene, vary=vary, engines=engines, execution=hv.Execution(**execution))


def telling(function):
    """A progress that calls a function with the engine of each row that is computed."""

    def each(done, engine):
        for _ in range(done):
            function(engine)

    return CallingBack(each)
