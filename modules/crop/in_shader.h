#pragma once

#include <memory>
#include <string>

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
