"""Whose page is it: by code, roster, file name or title block; a draft of the roster where none says so."""
