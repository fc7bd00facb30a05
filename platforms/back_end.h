#pragma once

#include <memory>
#include <vector>

#include <vrpipe/order_monitor.h>
#include <vrpipe/platforms/configuration.h>

namespace vrpipe {

/// QRU, SM and CROP of one GPC without time: a tested bin goes in, terminations come out.
class BackEnd {
 public:
  BackEnd(const Configuration& configuration, unsigned gpc, ColorSurface& surface)
      : qru(configuration.make_as<QruBehaviour>("qru", gpc)),
        sm(configuration.make_as<SmBehaviour>("sm", gpc)),
        crop(configuration.make_as<CropBehaviour>("crop", gpc)),
        monitor_(surface.width(), surface.height()) {
    crop->attach(surface);
  }

  /// Takes the survivors of a part of a bin. `signal` is called with each TerminationSignal.
  template <class Signal>
  void take(const QuadBeat& beat, Signal&& signal) {
    Warp warp;
    bool launched = false;
    for (unsigned from = 0; from < beat.count;) {
      from += qru->examine(beat, from, warp, launched);
      if (launched) run(warp, signal);
    }
    if (!beat.last_of_bin) return;
    while (qru->finish_bin(warp)) run(warp, signal);
  }

  std::unique_ptr<QruBehaviour> qru;
  std::unique_ptr<SmBehaviour> sm;
  std::unique_ptr<CropBehaviour> crop;

 private:
  template <class Signal>
  void run(const Warp& warp, Signal& signal) {
    sm->shade(warp, shaded_);
    for (unsigned i = 0; i < shaded_.count; ++i) {
      monitor_.blended(shaded_, i, 0);
      const LaneMask pixels =
          crop->blend(shaded_.tile, shaded_.position[i], shaded_.live[i], shaded_.color[i]).terminated;
      if (pixels != 0) signal(TerminationSignal{shaded_.tile, shaded_.position[i], pixels});
    }
  }

  ShadedWarp shaded_;
  BlendOrderMonitor monitor_;
};

/// Strict termination where there is time: runs tested bins ahead, in order, on units of its own.
class BinForesight : public TerminationForesight {
 public:
  BinForesight(const Configuration& configuration, unsigned gpc)
      : surface_(configuration.state_of(gpc).draw->width, configuration.state_of(gpc).draw->height,
                 configuration.request().format),
        back_end_(configuration, gpc, surface_) {}

  void bin_tested(TileId tile, const std::vector<Quad>& survivors, std::vector<TerminationSignal>& terminated) override;

 private:
  ColorSurface surface_;
  BackEnd back_end_;
};

}  // namespace vrpipe
