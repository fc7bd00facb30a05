#include "jobs/link_items.h"

#include <utility>

#include <fmt/format.h>

#include <vrpipe/platforms/configuration.h>

namespace vrpipe::tools {
namespace {

std::string text_of_mark(Mark mark) {
  return mark == Mark::end_of_frame ? "end of the frame" : fmt::format("mark {}", static_cast<unsigned>(mark));
}

std::string text_of_tile(TileId tile) { return fmt::format("tile {},{}", tile.x, tile.y); }

std::string text_of_quads(unsigned count) { return fmt::format("{} quad{}", count, count == 1 ? "" : "s"); }

std::string text_of_rect(const PixelRect& rect) {
  return fmt::format("pixels {},{} to {},{}", rect.x0, rect.y0, rect.x1 - 1, rect.y1 - 1);
}

std::string text_of_primitive(const Primitive& primitive) {
  return fmt::format("triangle {} of splat {}", unsigned{primitive.triangle}, primitive.splat);
}

}  // namespace

Netlist netlist_of(RunRequest request) {
  // What is observed keeps all its units and links.
  request.observers = std::make_shared<Observers>();
  return Configuration(request, Frame(1, 1)).netlist();
}

const char* name_of(TcBehaviour::FlushReason reason) {
  switch (reason) {
    case TcBehaviour::FlushReason::full: return "full";
    case TcBehaviour::FlushReason::evicted: return "evicted";
    case TcBehaviour::FlushReason::timed_out: return "timed out";
    case TcBehaviour::FlushReason::end_of_draw: return "end of the draw";
  }
  return "";
}

std::string text_of(const VertexWarp& item) {
  if (item.mark != Mark::none) return text_of_mark(item.mark);
  return fmt::format("vertex warp of splats {} to {}", item.first_splat, item.first_splat + item.splats - 1);
}

std::string text_of(const PrimitiveItem& item) {
  if (item.mark != Mark::none) return text_of_mark(item.mark);
  return text_of_primitive(item.primitive) + ", " + text_of_rect(item.primitive.bounds);
}

std::string text_of(const RasterJob& item) {
  if (item.mark != Mark::none) return text_of_mark(item.mark);
  return text_of_primitive(item.primitive) + ", in " + text_of_rect(item.clip);
}

std::string text_of(const QuadBeat& item) {
  if (item.mark != Mark::none) return text_of_mark(item.mark);
  return text_of_quads(item.count) + " of " + text_of_tile(item.tile) + (item.last_of_bin ? ", last of the bin" : "");
}

std::string text_of(const BinItem& item) {
  if (item.mark != Mark::none) return text_of_mark(item.mark);
  const std::string text = "bin of " + text_of_tile(item.tile) + ", " + text_of_quads(item.quads);
  return item.storage == nullptr ? text : text + ", flushed: " + name_of(item.storage->flush.reason);
}

std::string text_of(const Warp& item) {
  if (item.mark != Mark::none) return text_of_mark(item.mark);
  const auto pairs = static_cast<unsigned>(__builtin_popcount(item.merge_pairs));
  return fmt::format("warp {} of {}, {}{}", item.sequence, text_of_tile(item.tile), text_of_quads(item.count),
                     pairs == 0 ? ""
                                : fmt::format(", {} to merge", pairs == 1 ? "a pair" : fmt::format("{} pairs", pairs)));
}

std::string text_of(const ShadedWarpItem& item) {
  const ShadedWarp& warp = *item.warp;
  if (warp.mark != Mark::none) return text_of_mark(warp.mark);
  return fmt::format("warp {} of {}, {} left", warp.sequence, text_of_tile(warp.tile), text_of_quads(warp.count));
}

std::string text_of(const WarpRelease& item) {
  if (item.slot == no_slot) return "a mark, of no slot";
  return fmt::format("slot {} is free", item.slot);
}

std::string text_of(const ColorBeat& item) {
  if (item.mark != Mark::none) return text_of_mark(item.mark);
  if (item.count == 0) return text_of_quads(0);
  const ShadedWarp& warp = *item.quads[0].warp;
  return fmt::format("{} of warp {}, {}", text_of_quads(item.count), warp.sequence, text_of_tile(warp.tile));
}

std::string text_of(const TerminationBeat& item) {
  std::string text;
  for (unsigned i = 0; i < item.count; ++i) {
    const TerminationSignal& signal = item.signals[i];
    text += fmt::format("{}pixels {:04b} of quad {} of {} terminated", text.empty() ? "" : "; ",
                        unsigned{signal.pixels}, unsigned{signal.position}, text_of_tile(signal.tile));
  }
  return text;
}

std::string text_of(const HiZUpdate& item) {
  if (item.mark != Mark::none) return text_of_mark(item.mark);
  return fmt::format("farthest depth {} of part {} of {}", item.farthest, unsigned{item.part}, text_of_tile(item.tile));
}

std::string text_of(const PortReads& item) {
  return fmt::format("reads of {} flit{}", item.flits, item.flits == 1 ? "" : "s");
}

std::string text_of(const BlendsDone& item) { return "blended, all before " + text_of_mark(item.mark); }

}  // namespace vrpipe::tools
