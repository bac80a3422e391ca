"""Many runs of one filter, each with its own draw of everything random: is the filter as good as it says?

* `draw`: the draws of runs, from one seed; a source takes part by ``drawn_many``.
* `filtering`: the filter over many runs at once.
* `squares`, `part`: what is kept of a part of the runs.
* `campaign`, `parts_on_disk`: all parts on several processes, resumable.
* `dataset`, `verdicts`: the result, and what it says.
"""
