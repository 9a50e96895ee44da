"""What measurements share: configurations, times and their spread, and the Pareto front.

- `configuration`: one way to cull: the arguments of three calls in one object
- `stopwatch`: the stages of a view, each waited for and timed
- `spread`: medians and quartiles
- `pareto`: what nothing else beats in speed and error at once
- `volumes`: kinds of bounds by name, and parts of bounds
"""
