#include "dram/address_map.h"

namespace vrpipe {

namespace {

unsigned log2_of(std::uint32_t power_of_two) { return static_cast<unsigned>(__builtin_ctz(power_of_two)); }

}  // namespace

DramAddressMap::DramAddressMap(const DramParameters& p)
    : channels_(p.channels),
      burst_bits_(log2_of(burst_bytes(p))),
      low_column_bits_(log2_of(p.interleave_bytes / burst_bytes(p))),
      low_bank_bits_(0),
      high_column_bits_(log2_of(p.row_bytes / p.interleave_bytes)),
      high_bank_bits_(0),
      hash_(p.hash) {
  switch (static_cast<DramMapping>(static_cast<unsigned>(p.mapping))) {
    case DramMapping::row_bank_column_channel: break;
    case DramMapping::row_column_bank_channel: low_bank_bits_ = log2_of(p.banks); break;
    case DramMapping::row_bank_column_group_channel: low_bank_bits_ = log2_of(p.bank_groups); break;
  }
  high_bank_bits_ = log2_of(p.banks) - low_bank_bits_;
}

}  // namespace vrpipe
