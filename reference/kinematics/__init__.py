"""Positions, velocities and accelerations of a mechanism, solved to the last digits.

- `assur`: the closed forms of driving links and Assur groups
- `solving`: a mechanism solved group by group
- `motion`: exact motion of one variant or many, with a predicted error
- `continuation`: how far the driving link goes, and where branches cross
- `cycle`: the motion over a cycle
"""
