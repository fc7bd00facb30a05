#include <vrpipe/pipeline/slots/draw.h>
#include <vrpipe/pipeline/slots/qru.h>
#include <vrpipe/pipeline/slots/tgc.h>
#include <vrpipe/pipeline/slots/vpo.h>
#include <vrpipe/pipeline/slots/wdx.h>

namespace vrpipe {

namespace {

constexpr bool throughput = true;

double per(double items_per_cycle) { return 1.0 / items_per_cycle; }

}  // namespace

std::vector<WorkKind> DrawWork::kinds() { return {{"warps", 0, 1.0, throughput}}; }

std::vector<WorkKind> VpoWork::kinds(const Throughput& timing) {
  return {{"triangles", 0, per(timing.items_per_cycle), throughput}};
}

std::vector<WorkKind> WdxWork::kinds(const WdxBehaviour::Timing& timing, unsigned gpcs) {
  const double port = per(static_cast<double>(timing.primitives_per_cycle) * gpcs);
  return {{"taken", 0, port, throughput}, {"handed on", 1, port, throughput}};
}

std::vector<WorkKind> TgcWork::kinds(const Throughput& timing) {
  return {{"bin entries", 0, per(timing.items_per_cycle), throughput}, {"read-out", 1, 1.0, false}};
}

std::vector<WorkKind> QruWork::kinds(const Throughput& timing) {
  return {{"quads", 0, per(timing.items_per_cycle), throughput}, {"launches", 0, 1.0, false}};
}

}  // namespace vrpipe
