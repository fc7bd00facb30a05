#include <vrpipe/pipeline/slots/sm.h>

#include <fmt/format.h>

#include <vrpipe/component/error.h>
#include <vrpipe/pipeline/framebuffer.h>

namespace vrpipe {

std::uint32_t SmBehaviour::TimingParameters::fragment_slots() const {
  const std::uint64_t slots = std::uint64_t{cores} * warps_per_core;
  if (slots > no_slot) {
    throw UserError("unusable SM array", "sm.cores, sm.warps_per_core",
                    fmt::format("{} cores of {} warps are more than {} warps", cores, warps_per_core, no_slot),
                    "lower one of them");
  }
  return static_cast<std::uint32_t>(slots);
}

const std::vector<ShaderSegment>& SmBehaviour::TimingParameters::fragment_program(FragmentShader shader) const {
  switch (shader) {
    case FragmentShader::vertex:
    case FragmentShader::lit: return mesh.empty() ? fragment : mesh;
    case FragmentShader::alpha_threshold: return alpha_threshold.empty() ? fragment : alpha_threshold;
    case FragmentShader::splat:
    case FragmentShader::none: break;
  }
  return fragment;
}

void AttributeFetch::check() const {
  constexpr std::uint32_t primitive_bytes = attribute_bytes_per_splat / 2;
  if (attribute_bytes == 0 || attribute_bytes > primitive_bytes) {
    throw UserError("unusable SM array", "sm.attribute_bytes",
                    fmt::format("a primitive has {} bytes of attributes, not {}", primitive_bytes, attribute_bytes),
                    "read some of them");
  }
  if (buffer_bytes == 0 || buffer_bytes % CacheOrganization().line_bytes != 0) {
    throw UserError("unusable SM array", "sm.attribute_buffer_bytes",
                    fmt::format("{} bytes are no whole lines", buffer_bytes),
                    fmt::format("use a multiple of {}", CacheOrganization().line_bytes));
  }
  if (attribute_writes == 0 || l1_mshrs == 0) {
    throw UserError("unusable SM array", attribute_writes == 0 ? "sm.attribute_writes" : "sm.l1_mshrs",
                    "nothing could ever be under way", "use 1 or more");
  }
  if (l1.line_bytes != CacheOrganization().line_bytes || l1.sector_bytes != CacheOrganization().sector_bytes) {
    throw UserError("unusable L1 of an SM", "its lines", "they are other than those of attributes",
                    "use lines of 128 bytes, and sectors of 32");
  }
  if (!has_l1()) return;
  if (l1.bytes < l1.line_bytes) {
    throw UserError("unusable L1 of an SM", "sm.l1_bytes",
                    fmt::format("a line of {} bytes does not fit", l1.line_bytes), "use whole lines, or 0 for none");
  }
  const std::uint32_t ways = l1.ways_of_a_set();
  if (l1.lines() % ways != 0) {
    throw UserError("unusable L1 of an SM", "sm.l1_ways, sm.l1_bytes",
                    fmt::format("{} lines are no whole sets of {} ways", l1.lines(), ways),
                    "use bytes = sets x ways x line, or 0 ways for a fully associative cache");
  }
  l1.check("L1 of an SM", "sm", "l1_bytes");
}

}  // namespace vrpipe
