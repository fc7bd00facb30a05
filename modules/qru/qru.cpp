#include "qru/qru.h"

#include <algorithm>

#include <vrpipe/registry.h>

namespace vrpipe {

PairingQru::PairingQru(const Parameters& parameters, const RenderState&)
    : bin_quads_(parameters.bin_quads),
      quads_per_cycle_(parameters.quads_per_cycle),
      latency_cycles_(parameters.latency_cycles) {
  buffer_.reserve(bin_quads_);
  merged_.reserve(bin_quads_);
  registers_.fill(no_quad);
}

void PairingQru::launch(Warp& out) {
  out = warp_;
  warp_.count = 0;
  warp_.merge_pairs = 0;
  ++warps;
}

bool PairingQru::launch_when_full(Warp& out) {
  if (warp_.count < quads_per_warp) return false;
  launch(out);
  return true;
}

unsigned PairingQru::examine(const QuadBeat& beat, unsigned from, Warp& out, bool& launched) {
  launched = false;
  warp_.tile = beat.tile;
  unsigned taken = 0;
  while (from + taken < beat.count && !launched) {
    if (buffer_.size() == bin_quads_) {
      launched = finish_bin(out);
      continue;
    }
    const Quad& quad = beat.quads[from + taken];
    ++taken;
    ++quads;
    std::int16_t& partner = registers_[quad.position];
    if (partner == no_quad) {
      partner = static_cast<std::int16_t>(buffer_.size());
      buffer_.push_back(quad);
      merged_.push_back(false);
      continue;
    }
    const auto front = static_cast<std::size_t>(partner);
    partner = no_quad;
    merged_[front] = true;
    buffer_.push_back(quad);
    merged_.push_back(true);
    ++pairs;
    warp_.merge_pairs = static_cast<std::uint8_t>(warp_.merge_pairs | (1U << (warp_.count / 2)));
    warp_.quads[warp_.count++] = buffer_[front];
    warp_.quads[warp_.count++] = quad;
    launched = launch_when_full(out);
  }
  return taken;
}

bool PairingQru::finish_bin(Warp& out) {
  while (left_ < buffer_.size()) {
    const std::size_t id = left_++;
    if (merged_[id]) continue;
    warp_.quads[warp_.count++] = buffer_[id];
    if (launch_when_full(out)) return true;
  }
  buffer_.clear();
  merged_.clear();
  left_ = 0;
  registers_.fill(no_quad);
  if (warp_.count == 0) return false;
  launch(out);
  return true;
}

std::uint64_t PairingQru::storage_bytes() const {
  constexpr std::uint64_t pointer_bits = 32;
  constexpr std::uint64_t position_bits = 6;
  constexpr std::uint64_t register_bits = 8;
  return (std::uint64_t{bin_quads_} * (pointer_bits + position_bits + 1) + positions_per_tile * register_bits) / 8;
}

void QruPassThrough::launch(Warp& out) {
  out = warp_;
  warp_.count = 0;
  ++warps;
}

unsigned QruPassThrough::examine(const QuadBeat& beat, unsigned from, Warp& out, bool& launched) {
  warp_.tile = beat.tile;
  const unsigned taken = std::min<unsigned>(beat.count - from, quads_per_warp - warp_.count);
  std::copy_n(beat.quads.begin() + from, taken, warp_.quads.begin() + warp_.count);
  warp_.count = static_cast<std::uint8_t>(warp_.count + taken);
  quads += taken;
  launched = warp_.count == quads_per_warp;
  if (launched) launch(out);
  return taken;
}

bool QruPassThrough::finish_bin(Warp& out) {
  if (warp_.count == 0) return false;
  launch(out);
  return true;
}

namespace {
const Registrar<PairingQru, QruBehaviour> pairing("qru", "pairing",
                                                  "pairs overlapping quads of a bin for merging (QM)");
const Registrar<QruPassThrough, QruBehaviour> pass_through("qru", "pass-through", "warps in the order of the quads",
                                                           true);
}  // namespace

}  // namespace vrpipe
