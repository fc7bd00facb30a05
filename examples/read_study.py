#!/usr/bin/env python3
"""Mean speed-up of each variant of a study: read_study.py study.csv"""
import csv, sys
from collections import defaultdict
from math import exp, log

gains = defaultdict(list)
for point in csv.DictReader(open(sys.argv[1], newline="", encoding="utf-8")):
    if point["speedup"]:
        gains[point["variant"]].append(log(float(point["speedup"])))
for variant, logs in gains.items():
    print(f"{variant:16} {exp(sum(logs) / len(logs)):.3f}x over {len(logs)} points")
