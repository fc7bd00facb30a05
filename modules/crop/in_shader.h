#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "in_shader_time.h"

#include <vrpipe/model/timed.h>
#include <vrpipe/model/untimed.h>
#include <vrpipe/pipeline/registry.h>

namespace vrpipe {

/// The shader blends: in the place of a colour ROP each warp loads the pixels that it covers, blends in single precision and
/// stores what the format makes of it, past the SMs' L1s.
class InShaderBlending final : public CropBehaviour {
 public:
  using Parameters = InShaderParameters;
  /// Throws UserError if a draw terminates early: nobody would signal that.
  InShaderBlending(const Parameters& parameters, const RenderContext& context);

  void pass(Mark mark) override;
  /// All at once.
  Outcome blend(DrawIndex draw, std::size_t place, LaneMask live, const QuadColor& color) override {
    return store(draw, place, live, color, surface_->quad(place));
  }
  /// Of a quad that was loaded before: what has been stored to its pixels since is lost.
  Outcome store(DrawIndex draw, std::size_t place, LaneMask live, const QuadColor& color, const QuadColor& loaded);
  const InShaderTime& shader_time() const { return time_; }
  [[noreturn]] const CropTime& time() const override;

  Counter updates_lost{*this, "updates_lost", "fragments",
                       "that overwrote another update, stored since they had loaded the pixel"};

 private:
  const RenderContext& context_;
  const InShaderTime time_;
  const BlendFunction blend_;
};

/// Quads of warps as they were when they were loaded, where nothing is locked.
class LoadedColors {
 public:
  /// Keeps those of a warp from one on to another; returns their number.
  std::uint32_t load(const ColorSurface& surface, const ShadedWarp& warp, unsigned from, unsigned to) {
    if (free_.empty()) {
      free_.push_back(static_cast<std::uint32_t>(colors_.size()));
      colors_.emplace_back();
    }
    const std::uint32_t number = free_.back();
    free_.pop_back();
    const std::size_t place = surface.grid().place(warp.tile, 0);
    for (unsigned i = from; i < to; ++i) colors_[number][i] = surface.quad(place + warp.position[i]);
    return number;
  }
  /// Stores what is blended onto them, and lets go of them.
  void store(std::uint32_t number, InShaderBlending& shader, const ShadedWarp& warp, unsigned from, unsigned to) {
    const std::size_t place = shader.surface()->grid().place(warp.tile, 0);
    for (unsigned i = from; i < to; ++i)
      shader.store(warp.draw[i], place + warp.position[i], warp.live[i], warp.color[i], colors_[number][i]);
    free_.push_back(number);
  }

 private:
  std::vector<std::array<QuadColor, quads_per_warp>> colors_;
  std::vector<std::uint32_t> free_;
};

// The modules of slot `crop` around it.
std::unique_ptr<Unit> make_in_shader_unit(const std::string& name, ClockDomain& domain,
                                          std::unique_ptr<Behaviour> behaviour, const RenderContext& context);
std::unique_ptr<Unit> make_timed_in_shader_unit(const std::string& name, ClockDomain& domain,
                                                std::unique_ptr<Behaviour> behaviour, const RenderContext& context);
std::unique_ptr<UntimedUnit> make_untimed_in_shader_unit(const std::string& name, std::unique_ptr<Behaviour> behaviour,
                                                         const RenderContext& context);
inline bool blends_in_shader(const Behaviour& behaviour) {
  return dynamic_cast<const InShaderBlending*>(&behaviour.unit()) != nullptr;
}

}  // namespace vrpipe
