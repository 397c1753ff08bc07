"""Printed answer sheets: their markers, zones and cells."""
