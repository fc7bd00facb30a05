#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <vrpipe/kernel/accounting.h>
#include <vrpipe/pipeline/framebuffer.h>
#include <vrpipe/pipeline/slots/behaviour.h>

namespace vrpipe {

struct ZropTime;

/// Strict termination: what the bins tested so far will have terminated, whenever their quads reach CROP.
class FunctionalRunAhead {
 public:
  virtual ~FunctionalRunAhead() = default;
  /// A mark has come by, after all bins before it.
  virtual void pass(Mark mark) = 0;
  /// Takes the survivors of a part of a bin, as soon as that is tested, through merging, shading and blending; with the
  /// last of a bin, `terminated` has what all of them newly terminate.
  virtual void tested(const QuadBeat& survivors, std::vector<TerminationSignal>& terminated) = 0;
};

/// Slot `zrop`: depth and stencil test, before or after shading, termination test and update.
class ZropBehaviour : public Behaviour {
 public:
  /// Before the first test. One that overrides it calls it.
  virtual void attach(DepthStencilSurface& surface) { surface_ = &surface; }
  const DepthStencilSurface* surface() const { return surface_; }
  /// The tests before shading (DrawState::tests_early, tests_termination). Removes dead samples, and quads without a live
  /// one, from the beat; its tile and `last_of_bin` stay. Of its quads all are of one state; they may be of several draws.
  /// Where nothing is shaded (FragmentShader::none) all are removed.
  /// Returns which quads of the incoming beat have changed depth or stencil, a bit each.
  virtual std::uint32_t test(QuadBeat& beat) = 0;
  /// The test of depth and stencil after shading (DrawState::tests_late), of a warp whose live samples the shader has kept;
  /// its quads are of one state and not merged. Removes samples that fail (ShadedWarp::keep), and all where no colour is
  /// written (writes_color): they end here.
  /// Returns which quads of the incoming warp have changed depth or stencil, a bit each.
  virtual std::uint32_t test_late(ShadedWarp& warp) = 0;
  /// Sets the termination bit (stencil MSB) of the signalled pixels, unless they have been cleared since: then the
  /// signal's epoch has passed.
  virtual void update(const TerminationSignal& signal) = 0;
  /// A mark comes by, after all tests before it: a clear of termination is done (Frame::clear_of), for this GPC's tiles.
  virtual void pass(Mark mark) = 0;
  /// Strict mode at fidelities with time: termination comes from `run_ahead`, and `update` only costs time.
  /// Late tests are run ahead as well: `test_late` is called from within `run_ahead.tested`, and not when time comes.
  virtual void follow(FunctionalRunAhead& run_ahead) = 0;
  /// What its work takes: the parameters of its timing models (modules/zrop/zrop_time.h).
  virtual const ZropTime& time() const = 0;

  void use_surfaces(Framebuffer& framebuffer) override { attach(framebuffer.depth_stencil); }
  void add_to(Counts& counts, const CountOf& of) const override {
    counts.quads_depth_stencil_failed += of(quads_depth_stencil_failed);
    counts.fragments_depth_stencil_failed += of(fragments_depth_stencil_failed);
    counts.quads_terminated += of(quads_terminated);
    counts.fragments_terminated += of(fragments_terminated);
    counts.quads_unshaded += of(quads_unshaded);
    counts.fragments_unshaded += of(fragments_unshaded);
    counts.quads_late_failed += of(quads_late_failed);
    counts.fragments_late_failed += of(fragments_late_failed);
    counts.quads_unblended += of(quads_unblended);
    counts.fragments_unblended += of(fragments_unblended);
  }

  DrawCounter quads_tested{*this, "quads_tested", "quads",
                           "that entered a test before shading: of depth, stencil or termination"};
  DrawCounter quads_depth_stencil_failed{*this, "quads_depth_stencil_failed", "quads",
                                         "that lost their last fragment to the depth or stencil test"};
  DrawCounter fragments_depth_stencil_failed{*this, "fragments_depth_stencil_failed", "fragments",
                                             "that failed the depth or stencil test"};
  DrawCounter quads_terminated{*this, "quads_terminated", "quads",
                               "that lost their last fragment to the termination test"};
  DrawCounter fragments_terminated{*this, "fragments_terminated", "fragments", "that failed the termination test"};
  DrawCounter quads_tested_late{*this, "quads_tested_late", "quads",
                                "that entered a test of depth or stencil after shading"};
  DrawCounter quads_late_failed{*this, "quads_late_failed", "quads", "that lost their last fragment to such a test"};
  DrawCounter fragments_late_failed{*this, "fragments_late_failed", "fragments", "that failed such a test"};
  DrawCounter quads_unblended{*this, "quads_unblended", "quads",
                              "that passed such a test in a draw that writes no colour: they end here"};
  DrawCounter fragments_unblended{*this, "fragments_unblended", "fragments", "that passed such a test in such a draw"};
  DrawCounter quads_unshaded{*this, "quads_unshaded", "quads",
                             "that passed in a draw that shades nothing: they end here"};
  DrawCounter fragments_unshaded{*this, "fragments_unshaded", "fragments", "that passed in such a draw"};
  Counter termination_updates{*this, "termination_updates", "signals", "received from CROP, one for a quad's pixels"};

 protected:
  DepthStencilSurface* surface_ = nullptr;
};

/// The slot's kinds of work.
struct ZropWork {
  /// Quads tested before shading, cycles with updates, sectors moved, quads tested after shading; in thousandths of a cycle,
  /// what the blocks that quads touch take beyond their number.
  enum : unsigned { tests, updates, sectors, late_tests, blocks, kinds };
  /// And what is counted for `bound`.
  enum : unsigned { bytes_moved = kinds };
};

/// The slot's SlotCheck.
std::unique_ptr<Behaviour> check_zrop(const std::string& name, const RenderContext& context,
                                      std::unique_ptr<Behaviour> behaviour);

}  // namespace vrpipe
