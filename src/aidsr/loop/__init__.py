"""The method: iterations of one design (`loop`), parallel designs (`runner`), `design` and `resume` (`run`)."""
