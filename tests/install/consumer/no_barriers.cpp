// A render kernel of one's own as a plugin: the published one, if warps of a tile had no need to wait for one another.
// `vrpipe frames --plugin no_barriers.so --unit render=no-barriers`.
#include <vrpipe/modules/render/render.h>
#include <vrpipe/pipeline/registry.h>

VRPIPE_PLUGIN

namespace {

class NoBarriers : public vrpipe::PublishedKernel {
 public:
  using PublishedKernel::PublishedKernel;

  void render(std::size_t tile, const std::uint32_t* splats, std::uint32_t length, vrpipe::BlockWork& out) override {
    PublishedKernel::render(tile, splats, length, out);
    for (std::size_t i = out.warps; i < out.instructions.size(); ++i) {
      out.instructions[i % out.warps] += out.instructions[i];
      ++barriers_gone;
    }
    if (out.batches() > 1) out.instructions.resize(out.warps);
  }

  vrpipe::Counter barriers_gone{*this, "barriers_gone", "barriers", "that a warp does not wait at"};
};

const vrpipe::Registrar<NoBarriers, vrpipe::RenderBehaviour> unit("render", "no-barriers",
                                                                  "the published kernel without barriers");

}  // namespace
