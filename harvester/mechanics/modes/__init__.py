"""The motion of several modes or masses (`harvester.equations.modes`): one step, many trajectories, a recorded path."""
