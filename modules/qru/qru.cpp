#include "qru/qru.h"

#include <algorithm>

#include <vrpipe/pipeline/registry.h>

namespace vrpipe {

namespace {

/// Puts quads into a warp in their order; returns how many go in.
unsigned append(Warp& warp, const Quad* quads, unsigned count) {
  const unsigned taken = std::min<unsigned>(count, quads_per_warp - warp.count);
  std::copy_n(quads, taken, warp.quads.begin() + warp.count);
  warp.count = static_cast<std::uint8_t>(warp.count + taken);
  return taken;
}

}  // namespace

PairingQru::PairingQru(const Parameters& parameters, const RenderContext& context)
    : context_(context),
      any_unmerged_(std::any_of(context.frame->draws().begin(), context.frame->draws().end(),
                                [](const DrawCall& call) { return !call.state.merges(); })),
      bin_quads_(parameters.bin_quads),
      quads_per_cycle_(parameters.quads_per_cycle),
      latency_cycles_(parameters.latency_cycles),
      buffer_(bin_quads_),
      single_((bin_quads_ + bits_per_word - 1) / bits_per_word) {
  registers_.fill(no_quad);
}

void PairingQru::launch(Warp& out) {
  out = warp_;
  warp_.count = 0;
  warp_.merge_pairs = 0;
}

unsigned PairingQru::examine(TileId tile, const Quad* quads, unsigned count, Warp& out, bool& launched) {
  warp_.tile = tile;
  launched = false;
  // All of a bin are of one state.
  if (any_unmerged_ && count > 0 && !context_.state(quads[0].draw).merges()) {
    return pass_by(quads, count, out, launched);
  }
  unsigned at = 0;
  while (at < count && !launched) {
    if (buffered_ == bin_quads_) {
      launched = finish_bin(out);
      continue;
    }
    const unsigned end = at + std::min(count - at, bin_quads_ - buffered_);
    std::uint32_t id = buffered_;
    unsigned paired = warp_.count;
    for (; at < end && paired < quads_per_warp; ++at, ++id) {
      const Quad quad = quads[at];
      buffer_[id] = quad;
      // By masks, since a branch on whether the quad finds a partner would be mispredicted: about half do, in no order.
      std::uint16_t& held = registers_[quad.position];
      const std::uint32_t found = held != no_quad ? ~0U : 0U;
      const std::uint32_t front = id ^ ((id ^ held) & found);
      held = static_cast<std::uint16_t>(id | found);  // after a pair no_quad
      single_[front / bits_per_word] ^= std::uint64_t{1} << (front % bits_per_word);
      warp_.quads[paired] = buffer_[front];
      warp_.quads[paired + 1] = quad;
      paired += 2 & found;
    }
    buffered_ = id;
    warp_.count = static_cast<std::uint8_t>(paired);
    warp_.merge_pairs = static_cast<std::uint8_t>((1U << paired / 2) - 1);  // left-overs come at the end of the bin
    launched = paired == quads_per_warp;
    if (launched) launch(out);
  }
  return at;
}

unsigned PairingQru::pass_by(const Quad* quads, unsigned count, Warp& out, bool& launched) {
  const unsigned examined = append(warp_, quads, count);
  launched = warp_.count == quads_per_warp;
  if (launched) launch(out);
  return examined;
}

bool PairingQru::finish_bin(Warp& out) {
  for (; left_ * bits_per_word < buffered_; ++left_) {
    std::uint64_t& word = single_[left_];
    for (; word != 0; word &= word - 1) {
      if (warp_.count == quads_per_warp) {
        launch(out);
        return true;
      }
      warp_.quads[warp_.count++] = buffer_[left_ * bits_per_word + static_cast<unsigned>(__builtin_ctzll(word))];
    }
  }
  buffered_ = 0;
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
}

unsigned QruPassThrough::examine(TileId tile, const Quad* quads, unsigned count, Warp& out, bool& launched) {
  if (warp_.count == 0 && count >= quads_per_warp) {  // as most often
    out.tile = tile;
    out.count = quads_per_warp;
    out.merge_pairs = 0;
    out.mark = Mark::none;
    std::copy_n(quads, quads_per_warp, out.quads.begin());
    launched = true;
    return quads_per_warp;
  }
  warp_.tile = tile;
  const unsigned examined = append(warp_, quads, count);
  launched = warp_.count == quads_per_warp;
  if (launched) launch(out);
  return examined;
}

bool QruPassThrough::finish_bin(Warp& out) {
  if (warp_.count == 0) return false;
  launch(out);
  return true;
}

namespace {
const SlotRegistrar qru_slot{{"qru", 80, "pairing", "pass-through", false, check_qru}};
const Registrar<PairingQru, QruBehaviour> pairing("qru", "pairing", "pairs overlapping quads of a bin for merging (QM)",
                                                  false, Trust::trusted);
const Registrar<QruPassThrough, QruBehaviour> pass_through("qru", "pass-through", "warps in the order of the quads",
                                                           true, Trust::trusted);
const EffectRegistrar pairing_effect{{"qru",
                                      "pairing",
                                      "pairing",
                                      EffectKind::functional,
                                      "quad merging (QM): overlapping quads of a bin are blended as one",
                                      "the variant does without, and its QRU passes through",
                                      "the partial blend in the shader, and its instructions",
                                      "in the SM array, where a warp has pairs",
                                      {},
                                      [](const EffectQuestion&) { return EffectDecision::keep("QRU pairs"); }}};
}  // namespace

}  // namespace vrpipe
