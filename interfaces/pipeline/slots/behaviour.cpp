#include <vrpipe/pipeline/slots/behaviour.h>

#include <vrpipe/pipeline/framebuffer.h>
#include <vrpipe/pipeline/slots/crop.h>
#include <vrpipe/pipeline/slots/sm.h>
#include <vrpipe/pipeline/slots/zrop.h>

namespace vrpipe {

void attach_surfaces(Behaviour& unit, Framebuffer& framebuffer) {
  if (auto* const crop = dynamic_cast<CropBehaviour*>(&unit)) crop->attach(framebuffer.color);
  if (auto* const sm = dynamic_cast<SmBehaviour*>(&unit)) sm->attach(framebuffer.color);
  if (auto* const zrop = dynamic_cast<ZropBehaviour*>(&unit)) zrop->attach(framebuffer.depth_stencil);
}

}  // namespace vrpipe
