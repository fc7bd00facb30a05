#include "same_splat_qru.h"

#include <algorithm>
#include <string>
#include <utility>

#include <vrpipe/pipeline/frame_facts.h>
#include <vrpipe/pipeline/registry.h>

SameSplatQru::SameSplatQru(const Parameters& parameters, const vrpipe::RenderContext& context)
    : context_(context),
      timing_{parameters.quads_per_cycle, parameters.latency_cycles},
      pairs_gate_(context, "qru.same_splat_pairs") {}

unsigned SameSplatQru::examine(vrpipe::TileId tile, const vrpipe::Quad* quads, unsigned count, vrpipe::Warp& out,
                               bool& launched) {
  launched = false;
  warp_.tile = tile;
  unsigned examined = 0;
  while (examined < count && !launched) {
    const vrpipe::Quad& quad = quads[examined++];
    vrpipe::Quad& held = registers_[quad.position];
    if (held.coverage == 0) {
      held = quad;
    } else if (held.splat == quad.splat && may_merge(quad) && pairs_gate_.enter()) {
      add_pair(std::exchange(held, {}), quad);
    } else {
      add_single(std::exchange(held, quad));
    }
    launched = launch_when_full(out);
  }
  return examined;
}

bool SameSplatQru::finish_bin(vrpipe::Warp& out) {
  for (vrpipe::Quad& held : registers_) {
    if (held.coverage == 0) continue;
    add_single(std::exchange(held, {}));
    if (launch_when_full(out)) return true;
  }
  if (waiting_.coverage != 0) warp_.quads[warp_.count++] = std::exchange(waiting_, {});
  if (warp_.count == 0) return false;
  launch(out);
  return true;
}

bool SameSplatQru::may_merge(const vrpipe::Quad& quad) const { return context_.state(quad.draw).merges(); }

void SameSplatQru::add_pair(const vrpipe::Quad& front, const vrpipe::Quad& back) {
  if (waiting_.coverage != 0 && waiting_.position == front.position) {
    // The waiting single is in front of the pair, and quads of a position leave in order.
    fill_slots(std::exchange(waiting_, back), front, false);
    return;
  }
  fill_slots(front, back, true);
}

void SameSplatQru::add_single(const vrpipe::Quad& quad) {
  if (waiting_.coverage == 0) {
    waiting_ = quad;
  } else {
    fill_slots(std::exchange(waiting_, {}), quad, false);
  }
}

void SameSplatQru::fill_slots(const vrpipe::Quad& first, const vrpipe::Quad& second, bool merge) {
  if (merge) warp_.merge_pairs = static_cast<std::uint8_t>(warp_.merge_pairs | (1U << (warp_.count / 2U)));
  warp_.quads[warp_.count++] = first;
  warp_.quads[warp_.count++] = second;
}

bool SameSplatQru::launch_when_full(vrpipe::Warp& out) {
  if (warp_.count < vrpipe::quads_per_warp) return false;
  launch(out);
  return true;
}

void SameSplatQru::launch(vrpipe::Warp& out) {
  out = warp_;
  warp_.count = 0;
  warp_.merge_pairs = 0;
}

VRPIPE_PLUGIN

namespace {
const vrpipe::Registrar<SameSplatQru, vrpipe::QruBehaviour> registrar("qru", "same-splat",
                                                                      "pairs only quads of the same splat");

vrpipe::Effect same_splat_pairs() {
  vrpipe::Effect effect;
  effect.component = "qru";
  effect.name = "same_splat_pairs";
  effect.implementation = "same-splat";
  effect.kind = vrpipe::EffectKind::functional;
  effect.models = "quads of the two triangles of a splat are blended as one";
  effect.omitted_when = "no draw is of splats, or all are tested after shading, when nothing is merged";
  effect.elaborates = "what a pair takes in the shader";
  effect.tripwire = "where a quad meets one of the same splat";
  effect.decide = [](const vrpipe::EffectQuestion& asked) {
    const vrpipe::FrameFacts& facts = asked.facts;
    if (facts.of_splats == 0) return vrpipe::EffectDecision::omit("no draw is of splats");
    if (facts.tested_late == facts.draws) return vrpipe::EffectDecision::omit("all draws are tested after shading");
    return vrpipe::EffectDecision::keep("draws of splats: " + std::to_string(facts.of_splats));
  };
  return effect;
}
const vrpipe::EffectRegistrar pairs_effect(same_splat_pairs());
}  // namespace
