"""Reads an interval log by HdrHistogram's own Python package, and prints what it holds as JSON by tag."""

import json
import sys

from hdrh.histogram import HdrHistogram
from hdrh.log import HistogramLogReader

reader = HistogramLogReader(sys.argv[1], HdrHistogram(1, 1 << 40, 2))
found = {}
while (histogram := reader.get_next_interval_histogram()) is not None:
    tag = histogram.get_tag()
    assert tag not in found, f"{tag} is there twice"
    found[tag] = {
        "count": histogram.get_total_count(),
        "p50_us": histogram.get_value_at_percentile(50) / 1e3,
        "max_us": histogram.get_max_value() / 1e3,
        "seconds": (histogram.get_end_time_stamp() - histogram.get_start_time_stamp()) / 1e3,
    }
print(json.dumps(found))
