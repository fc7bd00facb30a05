#pragma once

#include <vrpipe/component/statistic.h>

namespace vrpipe {

/// What the channels of a DRAM count, all together; the cycles are those of the DRAM. Every burst read or written is
///     row_hits + row_misses + row_conflicts = reads + writes.
struct DramStatistics : StatisticSet {
  /// The part `name` of a component.
  DramStatistics(StatisticSet& owner, const char* name) : StatisticSet(owner, name) {}

  Counter activates{*this, "activates", "commands", "of a row"};
  Counter reads{*this, "reads", "commands", "of a burst"};
  Counter writes{*this, "writes", "commands", "of a burst"};
  Counter precharges{*this, "precharges", "commands", "of a bank; those of all banks before a refresh count as one"};
  Counter refreshes{*this, "refreshes", "commands", "of all banks of a channel"};
  Counter row_hits{*this, "row_hits", "bursts", "read or written in a row that is open for another"};
  Counter row_misses{*this, "row_misses", "bursts", "for which a row was opened in a bank without one"};
  Counter row_conflicts{*this, "row_conflicts", "bursts", "for which another row was closed before"};
  Counter reads_forwarded{*this, "reads_forwarded", "bursts", "read from the queue of writes"};
  Counter writes_merged{*this, "writes_merged", "bursts", "written over one that is queued"};
  Counter drain_cycles{*this, "drain_cycles", "cycles", "of a channel in which it writes instead of reading"};
  Counter data_cycles{*this, "data_cycles", "cycles", "of a channel's data bus with data on it, up to the frame's end"};
  Counter channel_cycles{*this, "channel_cycles", "cycles", "of all channels, at work or not"};
  Ratio row_hit_rate{*this,          row_hits,         row_hits + row_misses + row_conflicts,
                     "row_hit_rate", "hits per burst", "of bursts"};
  Ratio data_bus_utilization{*this,           data_cycles,           channel_cycles, "data_bus_utilization",
                             "of all cycles", "with data on the bus"};
  Histogram reads_queued{*this, Histogram::Buckets::linear(4, 65), "reads_queued", "bursts",
                         "that wait in a channel to be read, when another comes"};
  Histogram writes_queued{*this, Histogram::Buckets::linear(4, 65), "writes_queued", "bursts",
                          "that wait in a channel to be written, when another comes"};
  Histogram read_cycles{*this, Histogram::Buckets::log2(), "read_cycles", "cycles",
                        "from a read's entry into a channel's queue to its data"};
};

/// Of the timing models, in cycles of the GPU.
struct DramUnitStatistics : StatisticSet {
  DramStatistics channels{*this, "channels"};
  Counter requests_held{*this, "requests_held", "requests", "that had to wait at their port's entrance, at cycle"};
  Histogram read_latency{*this, Histogram::Buckets::log2(), "read_latency", "cycles",
                         "of the GPU, from a read's arrival to its answer"};
};

}  // namespace vrpipe
