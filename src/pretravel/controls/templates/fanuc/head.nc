(pretravel: {{ description }})
(map of kind {{ map.kind }}; tip radius {{ "%.6f"|format(map.tip_radius) }} mm)
(NOT TRIED ON A FANUC CONTROL)
