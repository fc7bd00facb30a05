#pragma once

#include <vrpipe/pipeline/slots/behaviour.h>

namespace vrpipe {

/// The slot's SlotCheck.
std::unique_ptr<Behaviour> check_crop(const std::string& name, const RenderContext& context,
                                      std::unique_ptr<Behaviour> behaviour);

}  // namespace vrpipe
