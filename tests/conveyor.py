"""A conveyor's mechanism as a file: a crank-rocker with a slider, some of its data by names."""

MECHANISM = """\
schema_version = 1
id = "course"
length_unit = "mm"
[title]
en = "Conveyor"
ro = "Transportor"
ru = "Конвейер"
[ground]
O1 = [0, 0]
O2 = ["d", 0]
[crank]
pivot = "O1"
pin = "A"
length = "a"
angle_deg = "phi"
rpm = 120
[[group]]
type = "RRR"
node = "B"
pins = ["A", "O2"]
links = ["2", "3"]
lengths = [210, 165]
side = "left"
[[group]]
type = "RRP"
node = "C"
pin = "B"
link = "4"
length = 320
guide = { through = [0, 150], angle_deg = 0 }
side = "ahead"
"""
