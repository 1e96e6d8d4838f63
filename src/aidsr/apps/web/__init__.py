"""The web app: set up a run, watch it, review designs, train them. `aidsr web` opens it.

    guard        checks of each request: host, origin, token, size
    site         state that all pages share: the runs and the processes at work on them
    processes    runs and trainings as separate processes, which outlive the web app
    frame, widgets, live    the look of pages, and parts of pages that follow changes
    home, setup_page, run_page, design_page …    the pages, each a view of run folders

All results are in run folders. The web app's own folder `.web` beside them holds unfinished form input, process logs,
prompts to answer by hand, and caches. NiceGUI is imported only when the web app is opened.
"""
