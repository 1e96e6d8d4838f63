"""The web app: set up a run, watch it, review designs, train them. `aidsr web` opens it.

    guard        who may ask: hosts, origins, token, sizes
    site         what all pages share: the runs, the processes at work, what a person began to type
    processes    runs and trainings as processes of their own, which outlive the web app
    frame, parts, live    how pages look, and how they keep up with what happens
    home, setup, run_page, design_page …    the pages, each a view on run folders

Nothing is kept here that is not in a run folder, except what a person has half typed. NiceGUI is loaded only by those
who open the web app.
"""
