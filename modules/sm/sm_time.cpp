#include "sm/sm_parameters.h"

#include <algorithm>

#include <fmt/format.h>

#include <vrpipe/component/error.h>
#include <vrpipe/pipeline/slots/sm.h>

namespace vrpipe {

namespace {

/// Of the bytes of attributes in single precision, 10 values: those that are left of 40 of them.
std::uint32_t attribute_bytes_in(AttributeFormat format, std::uint32_t bytes) {
  const std::uint32_t of_40 = format == AttributeFormat::fp32 ? 40 : format == AttributeFormat::fp16 ? 24 : 20;
  return (bytes * of_40 + 39) / 40;
}

AttributeFetch fetch_of(const SmParameters& parameters, AttributeFormat format) {
  AttributeFetch fetch;
  fetch.attribute_bytes = attribute_bytes_in(format, parameters.attribute_bytes);
  fetch.core_bytes = parameters.memory_bytes_per_cycle;
  fetch.buffer_bytes = parameters.attribute_buffer_bytes;
  fetch.attribute_writes = parameters.attribute_writes;
  fetch.l1_latency_cycles = parameters.l1_latency_cycles;
  fetch.l1_mshrs = parameters.l1_mshrs;
  fetch.l1.bytes = parameters.l1_bytes;
  fetch.l1.ways = parameters.l1_ways;
  if (fetch.buffer_bytes % fetch.l1.line_bytes != 0) {
    throw UserError("unusable SM array", "sm.attribute_buffer_bytes",
                    fmt::format("{} bytes are no whole lines", fetch.buffer_bytes),
                    fmt::format("use a multiple of {}", fetch.l1.line_bytes));
  }
  if (!fetch.has_l1()) return fetch;
  if (fetch.l1.bytes < fetch.l1.line_bytes) {
    throw UserError("unusable L1 of an SM", "sm.l1_bytes",
                    fmt::format("a line of {} bytes does not fit", fetch.l1.line_bytes),
                    "use whole lines, or 0 for none");
  }
  const std::uint32_t ways = fetch.l1.ways_of_a_set();
  if (fetch.l1.lines() % ways != 0) {
    throw UserError("unusable L1 of an SM", "sm.l1_ways, sm.l1_bytes",
                    fmt::format("{} lines are no whole sets of {} ways", fetch.l1.lines(), ways),
                    "use bytes = sets x ways x line, or 0 ways for a fully associative cache");
  }
  fetch.l1.check("L1 of an SM", "sm", "l1_bytes");
  return fetch;
}

}  // namespace

SmTime::SmTime(const SmParameters& parameters, const DevicePrecision& precision)
    : cores(parameters.cores),
      schedulers_per_core(parameters.schedulers_per_core),
      lanes_per_scheduler(parameters.lanes_per_scheduler),
      warps_per_core(parameters.warps_per_core),
      vertex_warps(parameters.vertex_warps),
      warps_to_one_core(parameters.warps_to_one_core),
      fetch(fetch_of(parameters, precision.attributes)) {
  if (32 % lanes_per_scheduler != 0) {
    throw UserError("unusable SM array", "sm.lanes_per_scheduler",
                    fmt::format("a warp of 32 threads does not issue in whole cycles on {} lanes", lanes_per_scheduler),
                    "use 1, 2, 4, 8, 16 or 32");
  }
  if (fragment_slots() > no_slot) {
    throw UserError("unusable SM array", "sm.cores, sm.warps_per_core",
                    fmt::format("{} cores of {} warps are more than {} warps", cores, warps_per_core, no_slot),
                    "lower one of them");
  }
  // The first instructions compute addresses and load; the rest waits for the attributes.
  const auto program = [&](std::uint32_t instructions, std::uint32_t latency, std::uint32_t first = 4) {
    const std::uint32_t loads = std::min(instructions, first);
    return std::vector<ShaderSegment>{{loads, parameters.attribute_latency_cycles}, {instructions - loads, latency}};
  };
  vertex = program(parameters.vertex_instructions, parameters.fragment_latency_cycles);
  fragment = program(parameters.fragment_instructions, parameters.fragment_latency_cycles);
  mesh = program(parameters.mesh_instructions, parameters.fragment_latency_cycles);
  // What follows the load is a compare and a discard.
  alpha_threshold = program(parameters.alpha_threshold_instructions, 0, 3);
  merge = {{parameters.merge_instructions, parameters.merge_latency_cycles}};
  hand_over.warp_thousandths = parameters.warp_launch_cycles.thousandths();
  hand_over.visit_thousandths = parameters.visit_launch_cycles.thousandths();
  hand_over.discard_thousandths = parameters.discard_launch_cycles.thousandths();
  hand_over.discard_warp_thousandths = parameters.discard_warp_cycles.thousandths();
}

const std::vector<ShaderSegment>& SmTime::fragment_program(FragmentShader shader) const {
  switch (shader) {
    case FragmentShader::vertex:
    case FragmentShader::lit: return mesh;
    case FragmentShader::alpha_threshold: return alpha_threshold;
    case FragmentShader::splat:
    case FragmentShader::none: break;
  }
  return fragment;
}

std::vector<WorkKind> SmTime::kinds() const {
  const double issue = 1.0 / instructions_per_cycle();
  return {{"vertices", 0, issue, true},
          {"fragments", 0, issue, true},
          {"merging", 0, issue, true},
          {"launches", 1, 1.0 / 1000, false},
          {"visits", 2, 1.0 / 1000, false}};
}

}  // namespace vrpipe
