#include <vrpipe/memory/memory_request.h>

namespace vrpipe {

const char* name_of(MemoryTraffic traffic) {
  constexpr std::array<const char*, memory_traffics> names = {"other", "color", "depth_stencil", "vertex", "attribute"};
  return names[static_cast<unsigned>(traffic)];
}

MemoryRequest request_of(const tlm::tlm_generic_payload& payload) {
  MemoryRequest request;
  request.address = payload.get_address();
  request.bytes = payload.get_data_length();
  request.command = payload.get_command();
  if (const auto* const extension = payload.get_extension<MemoryRequestExtension>()) {
    request.origin = extension->origin;
  }
  return request;
}

// Counters do not move: each is made in its place.
MemoryTrafficCounters::OfTraffic MemoryTrafficCounters::made(StatisticSet& owner, const Names& names,
                                                             const char* meaning) {
  return {{{{owner, names[0], "accesses", meaning}, {owner, names[1], "bytes", meaning}},
           {{owner, names[2], "accesses", meaning}, {owner, names[3], "bytes", meaning}}}};
}

MemoryTrafficCounters::MemoryTrafficCounters(StatisticSet& owner)
    : moved_{made(owner, {"other_reads", "other_bytes_read", "other_writes", "other_bytes_written"},
                  "of initiators that do not say what for"),
             made(owner, {"color_reads", "color_bytes_read", "color_writes", "color_bytes_written"},
                  "of the colour target"),
             made(owner,
                  {"depth_stencil_reads", "depth_stencil_bytes_read", "depth_stencil_writes",
                   "depth_stencil_bytes_written"},
                  "of the depth and stencil target"),
             made(owner, {"vertex_reads", "vertex_bytes_read", "vertex_writes", "vertex_bytes_written"},
                  "of the splats or vertices of a draw"),
             made(owner, {"attribute_reads", "attribute_bytes_read", "attribute_writes", "attribute_bytes_written"},
                  "of the attributes of shaded vertices")} {}

MemoryBytes MemoryTrafficCounters::bytes() const {
  MemoryBytes sum;
  for (const OfTraffic& traffic : moved_) sum += {traffic[false].bytes.value(), traffic[true].bytes.value()};
  return sum;
}

}  // namespace vrpipe
