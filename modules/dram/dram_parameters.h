#pragma once

#include <cstdint>

#include <vrpipe/component/parameter.h>
#include <vrpipe/kernel/accounting.h>

namespace vrpipe {

/// A default and where it comes from.
struct DramDefault {
  std::uint32_t value;
  const char* source;
};

/// What a kind of DRAM is unless its parameters say otherwise.
struct DramDevice {
  DramDefault channels, channel_bits, banks, bank_groups, row_bytes, burst_length, beats_per_cycle, tck_ps;
  DramDefault mapping, interleave_bytes;
  DramDefault trcd_ps, tcl_ps, tcwl_ps, trp_ps, trp_all_ps, tras_ps, trc_ps, twr_ps, tdqss_ps, twtr_ps, twtr_l_ps,
      trtp_ps, trrd_ps, trrd_l_ps, tfaw_ps, tccd_ps, tccd_l_ps, trtw_ps, trfc_ps, trefi_ps, activate_cycles;
  DramDefault read_queue;
};
extern const DramDevice lpddr3_1600;
extern const DramDevice lpddr5_6400;

/// In which order the fields of an address stand, from the highest bits to the lowest. Below them all is the place in
/// an interleaved piece: the low bits of the column, and the byte in a burst. Channels may be of any number (DramAddressMap).
enum class DramMapping : std::uint8_t {
  row_bank_column_channel,
  row_column_bank_channel,
  row_bank_column_group_channel,  ///< the bank's group low, the bank in it high
};

enum class DramPagePolicy : std::uint8_t { open, closed };

/// Distances are in picoseconds, as data sheets have nanoseconds; they become cycles of the DRAM by rounding up.
class DramParameters : public ParameterSet {
 public:
  /// `device` outlives it.
  explicit DramParameters(const DramDevice& device) : device_(device) {}

 private:
  const DramDevice& device_;  // before its users

 public:
  Integer channels{*this,
                   "channels",
                   device_.channels.value,
                   1,
                   64,
                   "channels",
                   device_.channels.source,
                   "of any number, each with a controller, a command bus and a data bus of its own: piece n is in "
                   "channel n mod channels"};
  Integer channel_bits{*this, "channel_bits", device_.channel_bits.value,  8,
                       256,   "bits",         device_.channel_bits.source, "width of a channel's data bus"};
  Integer banks{*this, "banks", device_.banks.value, 1, 32, "banks", device_.banks.source, "of a channel"};
  Integer bank_groups{*this,
                      "bank_groups",
                      device_.bank_groups.value,
                      1,
                      8,
                      "groups",
                      device_.bank_groups.source,
                      "of banks, within which tccd_l, trrd_l and twtr_l hold; 1 for none"};
  Integer row_bytes{*this, "row_bytes", device_.row_bytes.value,  64,
                    65536, "bytes",     device_.row_bytes.source, "of a row (page) of a channel's bank"};
  Integer burst_length{
      *this, "burst_length", device_.burst_length.value,  1,
      64,    "beats",        device_.burst_length.source, "of a burst, the least that a channel moves"};
  Integer beats_per_cycle{
      *this, "beats_per_cycle", device_.beats_per_cycle.value,  1,
      16,    "beats",           device_.beats_per_cycle.source, "that the data bus moves in a cycle of the DRAM"};
  Integer tck_ps{*this, "tck_ps", device_.tck_ps.value,  100,
                 20000, "ps",     device_.tck_ps.source, "a cycle of the DRAM: of its commands"};
  Choice mapping{*this,
                 "mapping",
                 {"row-bank-column-channel", "row-column-bank-channel", "row-bank-column-group-channel"},
                 device_.mapping.value,
                 device_.mapping.source,
                 "fields of an address, from the highest bits on; the lowest are the place in an interleaved piece"};
  Integer interleave_bytes{*this,
                           "interleave_bytes",
                           device_.interleave_bytes.value,
                           32,
                           65536,
                           "bytes",
                           device_.interleave_bytes.source,
                           "of neighbouring addresses in one channel; the next are in the next"};
  Switch hash{
      *this, "hash", true, "Zhang et al., MICRO 2000 (permutation-based page interleaving); of channels likewise",
      "the row is XORed into the bank, and all above the channel into the channel, so that strides spread; where "
      "channels are no power of two, a pseudo-random number of what is above is added, mod channels"};

  Integer trcd_ps{*this,   "trcd_ps", device_.trcd_ps.value,  1,
                  1000000, "ps",      device_.trcd_ps.source, "from the activate of a row to its first read or write"};
  Integer tcl_ps{*this,   "tcl_ps", device_.tcl_ps.value,  1,
                 1000000, "ps",     device_.tcl_ps.source, "from a read to its data"};
  Integer tcwl_ps{*this,   "tcwl_ps", device_.tcwl_ps.value,  1,
                  1000000, "ps",      device_.tcwl_ps.source, "from a write to its data"};
  Integer trp_ps{*this,   "trp_ps", device_.trp_ps.value,  1,
                 1000000, "ps",     device_.trp_ps.source, "from the precharge of a bank to its activate"};
  Integer trp_all_ps{
      *this,   "trp_all_ps", device_.trp_all_ps.value,  1,
      1000000, "ps",         device_.trp_all_ps.source, "from the precharge of all banks to what follows"};
  Integer tras_ps{*this,   "tras_ps", device_.tras_ps.value,  1,
                  1000000, "ps",      device_.tras_ps.source, "from the activate of a row to its precharge"};
  Integer trc_ps{*this,   "trc_ps", device_.trc_ps.value,  1,
                 1000000, "ps",     device_.trc_ps.source, "between two activates of a bank"};
  Integer twr_ps{*this,   "twr_ps", device_.twr_ps.value,  1,
                 1000000, "ps",     device_.twr_ps.source, "from the end of written data to the bank's precharge"};
  Integer tdqss_ps{
      *this,   "tdqss_ps", device_.tdqss_ps.value,  0,
      1000000, "ps",       device_.tdqss_ps.source, "that written data may come late, before twr and twtr begin"};
  Integer twtr_ps{*this,   "twtr_ps", device_.twtr_ps.value,  0,
                  1000000, "ps",      device_.twtr_ps.source, "from the end of written data to a read"};
  Integer twtr_l_ps{*this,   "twtr_l_ps", device_.twtr_l_ps.value,  0,
                    1000000, "ps",        device_.twtr_l_ps.source, "the same, within a group of banks"};
  Integer trtp_ps{*this,   "trtp_ps", device_.trtp_ps.value,  1,
                  1000000, "ps",      device_.trtp_ps.source, "from a read to the bank's precharge"};
  Integer trrd_ps{*this,   "trrd_ps", device_.trrd_ps.value,  1,
                  1000000, "ps",      device_.trrd_ps.source, "between activates of two banks"};
  Integer trrd_l_ps{*this,   "trrd_l_ps", device_.trrd_l_ps.value,  1,
                    1000000, "ps",        device_.trrd_l_ps.source, "the same, within a group of banks"};
  Integer tfaw_ps{*this,   "tfaw_ps", device_.tfaw_ps.value,  1,
                  1000000, "ps",      device_.tfaw_ps.source, "in which there are at most four activates (also tXAW)"};
  Integer tccd_ps{*this,   "tccd_ps", device_.tccd_ps.value,  1,
                  1000000, "ps",      device_.tccd_ps.source, "between two reads, or two writes"};
  Integer tccd_l_ps{*this,   "tccd_l_ps", device_.tccd_l_ps.value,  1,
                    1000000, "ps",        device_.tccd_l_ps.source, "the same, within a group of banks"};
  Integer trtw_ps{
      *this,   "trtw_ps", device_.trtw_ps.value,  0,
      1000000, "ps",      device_.trtw_ps.source, "for which the data bus idles between data read and data written"};
  Integer activate_cycles{
      *this, "activate_cycles", device_.activate_cycles.value,  1,
      2,     "cycles",          device_.activate_cycles.source, "that an activate takes of the command bus"};
  Switch refresh{*this, "refresh", true, "JEDEC", "all banks are refreshed every trefi"};
  Integer trfc_ps{*this,    "trfc_ps", device_.trfc_ps.value,  1,
                  10000000, "ps",      device_.trfc_ps.source, "that a refresh takes"};
  Integer trefi_ps{*this,     "trefi_ps", device_.trefi_ps.value,  1,
                   100000000, "ps",       device_.trefi_ps.source, "from one refresh falling due to the next"};

  Choice page_policy{*this,
                     "page_policy",
                     {"open", "closed"},
                     0,
                     "gem5: open_adaptive and close_adaptive",
                     "a row stays open until another is needed, or until no queued request needs it"};
  Integer read_queue{*this, "read_queue", device_.read_queue.value,  1,
                     256,   "bursts",     device_.read_queue.source, "that wait in a channel to be read"};
  Integer write_queue{
      *this, "write_queue", 64, 1, 256, "bursts", "gem5: write_buffer_size", "that wait in a channel to be written"};
  Integer write_high{*this,
                     "write_high",
                     54,
                     1,
                     256,
                     "bursts",
                     "gem5: write_high_thresh_perc, 85 %",
                     "waiting to be written, at which reads give way"};
  Integer write_low{*this,
                    "write_low",
                    32,
                    0,
                    255,
                    "bursts",
                    "gem5: write_low_thresh_perc, 50 %",
                    "left when reads have their turn again; without reads, what is more is written"};
  Integer age_cap_cycles{*this,        "age_cap_cycles",
                         1024,         1,
                         1000000,      "cycles",
                         source::open, "of the DRAM: who has waited longer goes before row hits"};
  Integer controller_ps{*this,
                        "controller_ps",
                        20000,
                        0,
                        1000000,
                        "ps",
                        "gem5: static_frontend_latency, static_backend_latency, 10 ns each",
                        "that controller and interface add to a read or write, both ways together"};
  Integer port_requests{*this,        "port_requests",
                        64,           1,
                        1024,         "requests",
                        source::open, "that a port holds while the queues of their channels are full"};
};

/// Distances between commands, in cycles of the DRAM, and what the controller of a channel decides by.
struct DramTiming {
  unsigned banks, groups;  ///< a bank's group is its number modulo `groups`
  Cycle burst;             ///< that data takes of the bus
  Cycle rcd, cl, cwl, rp, rp_all, ras, rc, wr, dqss, wtr, wtr_l, rtp, rrd, rrd_l, faw, ccd, ccd_l, rtw, rfc, refi;
  Cycle activate;  ///< cycles that an activate takes of the command bus
  bool refresh;
  bool closes_rows;  ///< that no queued request needs
  unsigned read_queue, write_queue, write_high, write_low;
  Cycle age_cap;
};

/// Throws UserError naming the rule that parameters break.
void check(const DramParameters& parameters);
/// Of parameters that can be.
DramTiming timing_of(const DramParameters& parameters);
/// The least that a channel moves.
unsigned burst_bytes(const DramParameters& parameters);

/// What all data buses move in `period_ps` while rows are open: their width less what refreshes take. No sequence of
/// accesses is faster in the long run.
double peak_bytes(const DramParameters& parameters, double period_ps);

}  // namespace vrpipe
