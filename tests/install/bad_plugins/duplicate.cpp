#include <vrpipe/pipeline/registry.h>
#include <vrpipe/pipeline/slots/draw.h>

VRPIPE_PLUGIN

namespace {

class Draws : public vrpipe::DrawBehaviour {
 public:
  struct Parameters : vrpipe::ParameterSet {};
  Draws(const Parameters&, const vrpipe::RenderContext&) {}
  bool next(vrpipe::VertexWarp&) override { return false; }
  std::uint32_t warps_per_1024_cycles() const override { return 1; }
};

const vrpipe::Registrar<Draws, vrpipe::DrawBehaviour> registrar("draw", "vertex-issue", "a name that is taken");

}  // namespace
