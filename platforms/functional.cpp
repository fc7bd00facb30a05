#include "functional.h"

#include "back_end.h"

namespace vrpipe {

void BinForesight::bin_tested(TileId tile, const std::vector<Quad>& survivors,
                              std::vector<TerminationSignal>& terminated) {
  QuadBeat beat;
  beat.tile = tile;
  std::size_t sent = 0;
  do {
    beat.count = static_cast<std::uint8_t>(std::min<std::size_t>(survivors.size() - sent, QuadBeat::capacity));
    std::copy_n(survivors.begin() + static_cast<std::ptrdiff_t>(sent), beat.count, beat.quads.begin());
    sent += beat.count;
    beat.last_of_bin = sent == survivors.size();
    back_end_.take(beat, [&](const TerminationSignal& signal) { terminated.push_back(signal); });
  } while (!beat.last_of_bin);
}

struct FunctionalGpu::Gpc {
  Gpc(const Configuration& configuration, unsigned gpc, ColorSurface& surface, bool with_bounds)
      : index(gpc),
        tests(configuration.state_of(gpc).early_termination),
        tgc(configuration.make_as<TgcBehaviour>("tgc", gpc)),
        raster(configuration.make_as<RasterBehaviour>("raster", gpc)),
        tc(configuration.make_as<TcBehaviour>("tc", gpc)),
        prop(configuration.make_as<PropBehaviour>("prop", gpc)),
        zrop(configuration.make_as<ZropBehaviour>("zrop", gpc)),
        back_end(configuration, gpc, surface),
        bound(configuration, gpc) {
    // A time-out flushes bins when this run does not, and quads of theirs may terminate those that are with them here.
    const bool times_out = tc->cost().timeout_in(configuration.request().termination) > 0;
    const bool any_order = times_out || prop->cost().order == PropBehaviour::Order::tile;
    if (with_bounds) back_end.count_into(bound.work, tests && times_out, any_order);
  }

  unsigned index;
  bool tests;
  std::unique_ptr<TgcBehaviour> tgc;
  std::unique_ptr<RasterBehaviour> raster;
  std::unique_ptr<TcBehaviour> tc;
  std::unique_ptr<PropBehaviour> prop;
  std::unique_ptr<ZropBehaviour> zrop;
  BackEnd back_end;
  PhaseBound bound;

  TgcBehaviour::Flush grid;
  TcBehaviour::Flush bin;
  QuadBeat tile;
};

FunctionalGpu::FunctionalGpu(const Configuration& configuration, ColorSurface& surface, bool with_bounds)
    : configuration_(configuration),
      draw_(configuration.make_as<DrawBehaviour>("draw", 0)),
      vpo_(configuration.make_as<VpoBehaviour>("vpo", 0)) {
  for (unsigned gpc = 0; gpc < configuration.platform().gpcs; ++gpc) {
    gpcs_.push_back(std::make_unique<Gpc>(configuration, gpc, surface, with_bounds));
  }
}

FunctionalGpu::~FunctionalGpu() = default;

void FunctionalGpu::bin_flushed(Gpc& gpc) {
  // All quads of a bin are tested before any is blended: the test sees the terminations of earlier bins only.
  Work& work = gpc.bound.work;
  QuadBeat beat;
  beat.tile = gpc.bin.tile;
  const std::vector<Quad>& quads = gpc.bin.quads;
  std::vector<QuadBeat>& tested = tested_;
  tested.clear();
  for (std::size_t sent = 0; sent < quads.size();) {
    beat.count = static_cast<std::uint8_t>(std::min<std::size_t>(quads.size() - sent, QuadBeat::capacity));
    std::copy_n(quads.begin() + static_cast<std::ptrdiff_t>(sent), beat.count, beat.quads.begin());
    sent += beat.count;
    beat.last_of_bin = sent == quads.size();
    ++work.bin_beats;
    if (gpc.tests) {
      work.quads_tested += beat.count;
      gpc.zrop->test(beat);
    }
    work.survivors += gpc.back_end.count_needed(beat);
    tested.push_back(beat);
  }
  for (const QuadBeat& part : tested) {
    gpc.back_end.take(part, [&](const TerminationSignal& signal) { gpc.zrop->update(signal); });
  }
  gpc.bound.quads_ended();
  if (gpc.bound.phase_is_full()) gpc.bound.end_phase();
}

void FunctionalGpu::rasterize(Gpc& gpc) {
  unsigned tests = 0;
  bool new_screen_tile = false;
  for (const Primitive& primitive : gpc.grid.primitives) {
    gpc.raster->begin(primitive, gpc.grid.clip);
    ++gpc.bound.work.setups;
    while (gpc.raster->next(gpc.tile, tests, new_screen_tile)) {
      Work& work = gpc.bound.work;
      work.coarse_tiles += tests;
      ++work.fine_tiles;
      work.tile_pairs += new_screen_tile ? 1U : 0U;
      work.quads_rasterized += gpc.tile.count;
      if (gpc.tile.count > 0) gpc.bound.quad_rasterized();
      for (unsigned from = 0; from < gpc.tile.count;) {
        bool flushed = false;
        from += gpc.tc->insert(gpc.tile, from, gpc.bin, flushed);
        if (flushed) bin_flushed(gpc);
      }
    }
    gpc.bound.work.coarse_tiles += tests;
  }
}

void FunctionalGpu::run(std::atomic<float>* progress) {
  VertexWarp warp;
  std::array<Primitive, 2> primitives;
  const auto total = static_cast<float>(configuration_.state_of(0).draw->splats.size());
  unsigned turn = 0;
  while (draw_->next(warp)) {
    gpcs_[turn]->back_end.sm->shade_vertices(warp);
    ++gpcs_[turn]->bound.work.vertex_warps;
    for (const auto& gpc : gpcs_) ++gpc->bound.work.vertex_warps_issued;
    turn = turn + 1 == gpcs_.size() ? 0 : turn + 1;
    for (std::uint32_t splat = warp.first_splat; splat < warp.first_splat + warp.splats; ++splat) {
      const unsigned count = vpo_->assemble(splat, primitives);
      for (const auto& gpc : gpcs_) gpc->bound.work.triangles += std::max(count, 1U);
      for (unsigned i = 0; i < count; ++i) {
        for (const auto& gpc : gpcs_) {
          if (!concerns(primitives[i], static_cast<unsigned>(gpcs_.size()), gpc->index)) continue;
          gpc->tgc->begin(primitives[i]);
          while (gpc->tgc->entering()) {
            ++gpc->bound.work.bin_entries;
            if (gpc->tgc->step(gpc->grid)) rasterize(*gpc);
          }
        }
      }
    }
    if (progress != nullptr && warp.first_splat % 1024 == 0) *progress = static_cast<float>(warp.first_splat) / total;
  }
  for (const auto& gpc : gpcs_) {
    while (gpc->tgc->drain(gpc->grid)) rasterize(*gpc);
    while (gpc->tc->flush_oldest(TcBehaviour::FlushReason::end_of_draw, gpc->bin)) bin_flushed(*gpc);
    gpc->bound.end_phase();
  }
  if (progress != nullptr) *progress = 1;
}

std::vector<const PhaseBound*> FunctionalGpu::bounds() const {
  std::vector<const PhaseBound*> all;
  for (const auto& gpc : gpcs_) all.push_back(&gpc->bound);
  return all;
}

BehaviourList FunctionalGpu::behaviours() const {
  BehaviourList list;
  list.of_slot = {{"draw", draw_.get()}, {"vpo", vpo_.get()}};
  for (const auto& gpc : gpcs_) {
    list.of_slot.insert(list.of_slot.end(), {{"tgc", gpc->tgc.get()},
                                             {"raster", gpc->raster.get()},
                                             {"tc", gpc->tc.get()},
                                             {"prop", gpc->prop.get()},
                                             {"zrop", gpc->zrop.get()},
                                             {"qru", gpc->back_end.qru.get()},
                                             {"sm", gpc->back_end.sm.get()},
                                             {"crop", gpc->back_end.crop.get()}});
  }
  return list;
}

}  // namespace vrpipe
