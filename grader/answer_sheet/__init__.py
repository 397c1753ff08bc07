"""Printable answer sheets: true-size A3 pages with markers, code, data, zones and boxes."""
