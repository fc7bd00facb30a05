#pragma once

#include <vrpipe/pipeline/render_context.h>

namespace vrpipe {

/// Whether bins go through ZROP before they are shaded (Frame::needs_zrop). PROP asks.
bool tests_before_shading(const RenderContext& context);

}  // namespace vrpipe
