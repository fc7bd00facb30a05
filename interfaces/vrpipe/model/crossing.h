#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <type_traits>

#include <vrpipe/model/timed.h>
#include <vrpipe/pipeline/batch.h>
#include <vrpipe/pipeline/payload.h>
#include <vrpipe/pipeline/slots/tc.h>

namespace vrpipe {

/// Items that are the same at `cycle` and at `lt`. `push(item, cycle)` for each that there is at cycle;
/// `send(item, cycles, places of the link)` for each at lt.
template <class Item>
struct SameAtBoth {
  template <class Push>
  static void into_cycle(const Item& item, CycleInterval at, unsigned, Push&& push) {
    push(item, at.first);
  }
  template <class Send>
  void out_of_cycle(const Item& item, Cycle at, Send&& send) {
    send(item, CycleInterval(at), 1U);
  }
  /// Adds one to another of the same cycle, beside which it takes the link; false if they stay apart.
  static bool join(Item&, const Item&) { return false; }
};

/// How an item of a link at `lt`, Loose, becomes items at `cycle`, Exact, and back: in the words of SameAtBoth, which most links
/// are.
template <class Exact, class Loose>
struct Crossing : SameAtBoth<Exact> {
  static_assert(std::is_same_v<Exact, Loose>, "an item that is another at lt has a Crossing of its own");
};

/// A tile of RASTER's moves at once at lt, at cycle in as many beats as it takes of the link.
template <>
struct Crossing<QuadBeat, QuadBeat> : SameAtBoth<QuadBeat> {
  template <class Push>
  static void into_cycle(const QuadBeat& item, CycleInterval at, unsigned beats, Push&& push) {
    QuadBeat part = item;
    for (unsigned beat = 0, from = 0; beat < std::max(beats, 1U); ++beat) {
      const unsigned end = beats == 0 ? item.count : item.count * (beat + 1) / beats;
      part.count = static_cast<std::uint8_t>(end - from);
      std::copy(item.quads.begin() + from, item.quads.begin() + end, part.quads.begin());
      push(part, at.of_part(beat, beats));
      from = end;
    }
  }
};

/// Bins: at cycle they move in beats, and come from there in parts of one beat.
template <>
struct Crossing<QuadBeat, BinItem> {
  template <class Push>
  static void into_cycle(const BinItem& item, CycleInterval at, unsigned beats, Push&& push) {
    QuadBeat beat;
    beat.tile = item.tile;
    beat.mark = item.mark;
    if (item.mark != Mark::none) return push(beat, at.first);
    beats = std::max({beats, (item.quads + QuadBeat::capacity - 1) / QuadBeat::capacity, 1U});
    const unsigned of_beat = (item.quads + beats - 1) / beats;
    for (unsigned i = 0; i < beats; ++i) {
      const unsigned from = std::min(item.quads, i * of_beat);
      const unsigned end = std::min(item.quads, from + of_beat);
      beat.count = static_cast<std::uint8_t>(end - from);
      beat.last_of_bin = item.last_part && i + 1 == beats;
      std::copy_n(item.storage->flush.quads.begin() + from, beat.count, beat.quads.begin());
      if (beat.count > 0 || beat.last_of_bin) push(beat, at.of_part(i, beats));
    }
    item.storage->in_use = false;
  }
  static bool join(QuadBeat&, const QuadBeat&) { return false; }
  template <class Send>
  void out_of_cycle(const QuadBeat& beat, Cycle at, Send&& send) {
    BinItem item;
    item.tile = beat.tile;
    item.mark = beat.mark;
    if (beat.mark == Mark::none) {
      item.storage = &unused_storage();
      item.storage->in_use = true;
      item.storage->flush.tile = beat.tile;
      item.storage->flush.quads.assign(beat.quads.begin(), beat.quads.begin() + beat.count);
      item.quads = beat.count;
      item.last_part = beat.last_of_bin;
    }
    send(item, CycleInterval(at), 1U);
  }

 private:
  BinStorage& unused_storage() {
    for (BinStorage& each : storage_) {
      if (!each.in_use) return each;
    }
    return storage_.emplace_back();
  }
  std::deque<BinStorage> storage_;
};

/// Shaded warps: at cycle they move to CROP in beats, and come from there whole.
template <>
struct Crossing<ColorBeat, ShadedWarpItem> {
  template <class Push>
  static void into_cycle(const ShadedWarpItem& item, CycleInterval at, unsigned, Push&& push) {
    const ShadedWarp& warp = *item.warp;
    ColorBeat beat;
    beat.mark = warp.mark;
    if (warp.mark != Mark::none) {
      warp.release();
      return push(beat, at.first);
    }
    Cycle cycle = at.first;
    for (std::uint32_t i = 0; i < warp.count; ++i) {
      const Cycle moves = at.of_part(i, warp.count);
      if (beat.count == ColorBeat::capacity || (beat.count > 0 && moves != cycle)) {
        push(beat, cycle);
        beat.count = 0;
      }
      cycle = moves;
      beat.quads[beat.count++] = {&warp, i};
    }
    push(beat, cycle);
  }
  static bool join(ColorBeat& beat, const ColorBeat& next) {
    if (beat.mark != Mark::none || next.mark != Mark::none || beat.count + next.count > ColorBeat::capacity)
      return false;
    for (unsigned i = 0; i < next.count; ++i) beat.quads[beat.count++] = next.quads[i];
    return true;
  }
  template <class Send>
  void out_of_cycle(const ColorBeat& beat, Cycle at, Send&& send) {
    if (beat.mark != Mark::none) {
      mark_.mark = beat.mark;
      mark_.count = 0;
      return send({&mark_}, CycleInterval(at), 1U);
    }
    ++beats_;
    for (unsigned i = 0; i < beat.count; ++i) {
      const ColorQuad& quad = beat.quads[i];
      if (quad.index == 0) first_ = at;
      if (!quad.is_last()) continue;
      // One that begins in the last beat of the warp before it, and ends there, takes no beat of its own.
      send({quad.warp}, CycleInterval(first_, at), beats_);
      beats_ = 0;
    }
  }

 private:
  ShadedWarp mark_;
  Cycle first_ = 0;     ///< of the warp under way
  unsigned beats_ = 0;  ///< that no warp has been charged with yet
};

}  // namespace vrpipe
