#include "dram/dram_parameters.h"

#include <algorithm>
#include <initializer_list>
#include <string>

#include <fmt/format.h>

#include <vrpipe/component/error.h>

namespace vrpipe {

namespace {

constexpr const char* lpddr3_gem5 = "gem5: LPDDR3_1600_1x32 (Micron EDF8132A1MC)";
constexpr const char* lpddr5_gem5 = "gem5: LPDDR5_6400_1x16_BG_BL16";
constexpr const char* lpddr5_jedec = "JESD209-5, as in Ramulator 2: LPDDR5_6400";
constexpr const char* no_groups = "LPDDR3 has no bank groups";

}  // namespace

const DramDevice lpddr3_1600 = {
    {16, source::paper_table},
    {32, "gem5: LPDDR3_1600_1x32; 64 gives the Orin's 204.8 GB/s"},
    {8, "JESD209-3"},
    {1, no_groups},
    {4096, lpddr3_gem5},
    {8, "JESD209-3"},
    {2, "JESD209-3: double data rate"},
    {1250, "JESD209-3: 1600 MT/s"},
    {static_cast<unsigned>(DramMapping::row_bank_column_channel), "gem5: RoRaBaCoCh"},
    {256, "Accel-Sim: memory partitions are interleaved by 256 bytes"},
    {18000, lpddr3_gem5},
    {15000, lpddr3_gem5},
    {7500, "JESD209-3: WL of 6 cycles (set A) at RL of 12"},
    {18000, lpddr3_gem5},
    {21000, "JESD209-3: tRPab"},
    {42000, lpddr3_gem5},
    {60000, "JESD209-3: tRAS + tRPpb"},
    {15000, lpddr3_gem5},
    {1250, "JESD209-3: WL + 1 + BL/2 + tWTR"},
    {7500, lpddr3_gem5},
    {7500, no_groups},
    {7500, lpddr3_gem5},
    {10000, lpddr3_gem5},
    {10000, no_groups},
    {50000, lpddr3_gem5},
    {5000, "JESD209-3: 4 cycles"},
    {5000, no_groups},
    {2500, lpddr3_gem5},
    {130000, lpddr3_gem5},
    {3900000, lpddr3_gem5},
    {1, "JESD209-3: a command takes both edges of a cycle"},
    {32, "gem5: read_buffer_size"},
};

// 16 banks in four groups, which is what LPDDR5 needs above 3.2 Gb/s to move bursts of 16.
const DramDevice lpddr5_6400 = {
    {16, "Jetson AGX Orin: 256 bits, 204.8 GB/s"},
    {16, lpddr5_gem5},
    {16, lpddr5_gem5},
    {4, lpddr5_gem5},
    {2048, lpddr5_gem5},
    {16, "gem5: LPDDR5_6400_1x16_BG_BL16; a burst is a sector of 32 bytes"},
    {8, "gem5: LPDDR5_6400_1x16_BG_BL16; four data clocks a cycle, double data rate"},
    {1250, lpddr5_gem5},
    {static_cast<unsigned>(DramMapping::row_bank_column_group_channel),
     "bursts of one group go at half the rate, so neighbours are in different ones"},
    {128, "a cache line"},
    {18000, lpddr5_gem5},
    {21250, lpddr5_gem5},
    {11250, lpddr5_jedec},
    {18000, lpddr5_gem5},
    {21000, lpddr5_jedec},
    {42000, lpddr5_gem5},
    {60000, "JESD209-5: tRAS + tRPpb"},
    {34000, lpddr5_gem5},
    {0, "JESD209-5: within tWTR"},
    {6250, lpddr5_gem5},
    {12000, lpddr5_gem5},
    {4590, lpddr5_gem5},
    {5000, lpddr5_gem5},
    {5000, lpddr5_gem5},
    {20000, lpddr5_gem5},
    {2500, lpddr5_gem5},
    {5000, lpddr5_gem5},
    {1250, lpddr5_gem5},
    {210000, lpddr5_gem5},
    {3900000, lpddr5_gem5},
    {1, "JESD209-5: two, which may be apart (tAAD) and fit between reads"},
    {64, "gem5: read_buffer_size of LPDDR5"},
};

namespace {

[[noreturn]] void refuse(const std::string& where, const std::string& why, const std::string& remedy) {
  throw UserError("unusable DRAM", where, why, remedy);
}

void check_power_of_two(const Integer& parameter, const char* remedy) {
  const std::uint32_t value = parameter;
  if ((value & (value - 1)) == 0) return;
  refuse(std::string("dram.") + parameter.name(), fmt::format("{} is no power of two", value), remedy);
}

/// `less` is at most `more`, both in the same unit.
void check_order(const Integer& less, const Integer& more, const char* rule) {
  if (less <= more) return;
  refuse(fmt::format("dram.{}, dram.{}", less.name(), more.name()),
         fmt::format("{} is {}, more than {} of {}: {}", less.name(), less.value(), more.name(), more.value(), rule),
         "raise the one or lower the other");
}

/// The sum of distances is at most another one.
void check_sum(std::initializer_list<const Integer*> parts, const Integer& whole, const char* rule) {
  std::uint64_t sum = 0;
  std::string names;
  for (const Integer* part : parts) {
    sum += *part;
    names += (names.empty() ? "" : " + ") + std::string(part->name());
  }
  if (sum <= whole) return;
  refuse(fmt::format("dram.{}", whole.name()),
         fmt::format("{} is {}, less than {} of {}: {}", whole.name(), whole.value(), names, sum, rule),
         fmt::format("use at least {}", sum));
}

void check_geometry(const DramParameters& p) {
  for (const Integer* parameter :
       {&p.channel_bits, &p.banks, &p.bank_groups, &p.row_bytes, &p.burst_length, &p.beats_per_cycle})
    check_power_of_two(*parameter, "use a power of two, as every DRAM standard has it; channels may be any number");
  check_power_of_two(p.interleave_bytes, "use a power of two");
  check_order(p.bank_groups, p.banks, "a group has a bank");
  const unsigned burst = burst_bytes(p);
  if (p.burst_length < p.beats_per_cycle) {
    refuse("dram.burst_length, dram.beats_per_cycle",
           fmt::format("a burst of {} beats takes less than a cycle of {}", p.burst_length.value(),
                       p.beats_per_cycle.value()),
           "use a burst of one cycle or more");
  }
  if (burst < 8) {
    refuse("dram.channel_bits, dram.burst_length",
           fmt::format("the channel is too narrow: a burst moves {} bytes", burst),
           "widen it, so that a burst moves at least 8 bytes");
  }
  if (burst > p.row_bytes) {
    refuse("dram.row_bytes",
           fmt::format("a burst of {} bytes does not fit into a row of {}", burst, p.row_bytes.value()),
           fmt::format("use at least {}", burst));
  }
  if (burst > 128) {
    refuse("dram.channel_bits, dram.burst_length",
           fmt::format("a burst of {} bytes is more than a cache line of 128", burst), "narrow it");
  }
  if (burst > p.interleave_bytes) {
    refuse("dram.interleave_bytes", fmt::format("a burst of {} bytes would be in more than one channel", burst),
           fmt::format("use at least {}", burst));
  }
  check_order(p.interleave_bytes, p.row_bytes, "an interleaved piece is in one row");
}

void check_distances(const DramParameters& p) {
  check_sum({&p.trcd_ps, &p.trtp_ps}, p.tras_ps, "a row is read before it is closed");
  check_sum({&p.tras_ps, &p.trp_ps}, p.trc_ps, "a row is open and then closed before the next is opened");
  check_order(p.trp_ps, p.trp_all_ps, "precharging all banks takes no less than one of them");
  check_order(p.trrd_ps, p.trrd_l_ps, "distances are no shorter within a group");
  check_order(p.tccd_ps, p.tccd_l_ps, "distances are no shorter within a group");
  check_order(p.twtr_ps, p.twtr_l_ps, "distances are no shorter within a group");
  check_order(p.trrd_ps, p.tfaw_ps, "four activates take longer than one");
  const std::uint64_t burst_ps = std::uint64_t{p.burst_length / p.beats_per_cycle} * p.tck_ps;
  if (p.tccd_ps < burst_ps) {
    refuse("dram.tccd_ps",
           fmt::format("tccd_ps is {}, less than the {} ps of a burst: bursts would overlap on the data bus",
                       p.tccd_ps.value(), burst_ps),
           fmt::format("use at least {}", burst_ps));
  }
  if (p.tcwl_ps > p.tcl_ps + burst_ps) {
    refuse("dram.tcwl_ps", "data written would come after that of a read that follows", "use at most tcl_ps");
  }
  if (!p.refresh) return;
  // Rows are closed, after what was last written, and there is time for a row or more between refreshes.
  check_sum({&p.trfc_ps, &p.trp_all_ps, &p.trc_ps, &p.tcwl_ps, &p.twr_ps}, p.trefi_ps,
            "the DRAM would do nothing but refresh");
}

void check_queues(const DramParameters& p) {
  check_order(p.write_high, p.write_queue, "writes drain before their queue is full");
  if (p.write_low >= p.write_high) {
    refuse("dram.write_low, dram.write_high",
           fmt::format("the drain of writes ends at {} and begins at {}", p.write_low.value(), p.write_high.value()),
           "use write_low < write_high <= write_queue");
  }
}

}  // namespace

unsigned burst_bytes(const DramParameters& parameters) { return parameters.burst_length * parameters.channel_bits / 8; }

void check(const DramParameters& parameters) {
  check_geometry(parameters);
  check_distances(parameters);
  check_queues(parameters);
}

DramTiming timing_of(const DramParameters& p) {
  check(p);
  const auto cycles = [&](std::uint32_t ps) -> Cycle { return (std::uint64_t{ps} + p.tck_ps - 1) / p.tck_ps; };
  DramTiming t{};
  t.banks = p.banks;
  t.groups = p.bank_groups;
  t.burst = p.burst_length / p.beats_per_cycle;
  t.rcd = cycles(p.trcd_ps);
  t.cl = cycles(p.tcl_ps);
  t.cwl = cycles(p.tcwl_ps);
  t.rp = cycles(p.trp_ps);
  t.rp_all = cycles(p.trp_all_ps);
  t.ras = cycles(p.tras_ps);
  t.rc = cycles(p.trc_ps);
  t.wr = cycles(p.twr_ps);
  t.dqss = cycles(p.tdqss_ps);
  t.wtr = cycles(p.twtr_ps);
  t.wtr_l = cycles(p.twtr_l_ps);
  t.rtp = cycles(p.trtp_ps);
  t.rrd = cycles(p.trrd_ps);
  t.rrd_l = cycles(p.trrd_l_ps);
  t.faw = cycles(p.tfaw_ps);
  t.ccd = cycles(p.tccd_ps);
  t.ccd_l = cycles(p.tccd_l_ps);
  t.rtw = cycles(p.trtw_ps);
  t.rfc = cycles(p.trfc_ps);
  // What falls due more often is no fault; what falls due less often is.
  t.refi = p.trefi_ps / p.tck_ps;
  t.activate = p.activate_cycles;
  t.refresh = p.refresh;
  t.closes_rows = p.page_policy == static_cast<unsigned>(DramPagePolicy::closed);
  t.read_queue = p.read_queue;
  t.write_queue = p.write_queue;
  t.write_high = p.write_high;
  t.write_low = p.write_low;
  t.age_cap = p.age_cap_cycles;
  return t;
}

double peak_bytes(const DramParameters& parameters, double period_ps) {
  const DramTiming t = timing_of(parameters);
  // Within a group of banks bursts are further apart; with one group alone there are no others.
  const Cycle apart = t.groups == 1 ? t.ccd_l : t.ccd;
  const double per_cycle = static_cast<double>(burst_bytes(parameters)) / static_cast<double>(apart) *
                           static_cast<double>(parameters.channels);
  const double share = t.refresh ? 1.0 - static_cast<double>(t.rfc) / static_cast<double>(t.refi) : 1.0;
  return per_cycle * share * period_ps / static_cast<double>(parameters.tck_ps);
}

}  // namespace vrpipe
