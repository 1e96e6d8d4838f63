"""What can be said about an MJCF document before MuJoCo compiles it.

    forbidden, bounds    what an untrusted document may not hold, or not so much of
    grammar              elements and attributes MJCF does not know
    naming               names used twice, and names that nothing bears
    fitting              attributes that do not fit the type they stand on

Each check takes the root element and yields faults. `place` says where in the document a fault is.
"""
