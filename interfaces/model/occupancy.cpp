#include <vrpipe/model/occupancy.h>

namespace vrpipe {

namespace {

constexpr bool throughput = true;

double per(double items_per_cycle) { return 1.0 / items_per_cycle; }

}  // namespace

std::vector<WorkKind> DrawWork::kinds() { return {{"warps", 0, 1.0, throughput}}; }

std::vector<WorkKind> VpoWork::kinds(const Throughput& cost) {
  return {{"triangles", 0, per(cost.items_per_cycle), throughput}};
}

std::vector<WorkKind> TgcWork::kinds(const Throughput& cost) {
  return {{"bin entries", 0, per(cost.items_per_cycle), throughput}, {"read-out", 1, 1.0, false}};
}

std::vector<WorkKind> RasterWork::kinds(const RasterBehaviour::Cost& cost) {
  return {{"set-up", 0, static_cast<double>(cost.setup_interval_cycles), false},
          {"coarse tests", 1, per(cost.coarse_tiles_per_cycle), false},
          {"fine tiles", 2, per(cost.fine_tiles_per_cycle), false},
          {"screen tiles", 3, static_cast<double>(cost.screen_tile_interval_cycles), false},
          {"quads", 4, per(cost.quads_per_cycle), throughput}};
}

std::vector<WorkKind> TcWork::kinds(const TcBehaviour::Cost& cost) {
  return {{"quads", 0, per(cost.quads_per_cycle), throughput}, {"read-out", 1, 1.0, false}};
}

std::vector<WorkKind> PropWork::kinds(const PropBehaviour::Cost& cost) {
  return {{"bins", 0, per(cost.quads_per_cycle), false},
          {"survivors", 1, per(cost.quads_per_cycle), false},
          {"colours", 2, per(cost.color_rate.per_cycle()), throughput},
          {"empty warps", 2, 1.0, false}};
}

std::vector<WorkKind> ZropWork::kinds(const ZropBehaviour::Cost& cost) {
  return {{"tests", 0, per(cost.quads_per_cycle), throughput}, {"updates", 0, 1.0, false}};
}

std::vector<WorkKind> QruWork::kinds(const Throughput& cost) {
  return {{"quads", 0, per(cost.items_per_cycle), throughput}, {"launches", 0, 1.0, false}};
}

std::vector<WorkKind> SmWork::kinds(const SmBehaviour::Cost& cost) {
  const double issue = per(cost.instructions_per_cycle());
  return {{"vertices", 0, issue, throughput}, {"fragments", 0, issue, throughput}, {"merging", 0, issue, throughput}};
}

std::vector<WorkKind> CropWork::kinds(const CropBehaviour::Cost& cost) {
  return {{"blend", 0, per(cost.blend_rate.per_cycle()), throughput},
          {"sectors", 0, per(cost.sectors_per_cycle), false},
          {"forwarding", 0, 1.0 / static_cast<double>(parts_of_a_cycle(cost)), false}};
}

}  // namespace vrpipe
