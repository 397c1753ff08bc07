"""Owners of pages by code, roster, file name or title block; a draft of the roster for the rest."""
