#include <vrpipe/pipeline/early_tests.h>

namespace vrpipe {

bool tests_before_shading(const RenderContext& context) {
  if (!context.frame->needs_zrop()) return false;
  if (context.has_part("zrop")) return true;
  for (const DrawCall& call : context.frame->draws()) {
    const DrawState& state = call.state;
    if (state.early_termination) EffectGate(context, "zrop.termination").enter();
    if (state.tests_depth_stencil() || state.shader == FragmentShader::none)
      EffectGate(context, "zrop.depth_stencil").enter();
  }
  return false;
}

}  // namespace vrpipe
