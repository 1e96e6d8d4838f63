"""The method: iterations of one design (`loop`), designs side by side (`runner`), `design` and `resume` (`run`)."""
