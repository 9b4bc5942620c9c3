"""whittle-submit: submits scenes to a Whittle service and downloads the images. Python 3.11, no packages.

    cli (options) -> sweep (frames, batches) -> run (state file, submission, waiting) -> server (HTTP, events)
"""
