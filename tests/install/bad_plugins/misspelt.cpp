#include <vrpipe/modules/tc/tc.h>
#include <vrpipe/pipeline/registry.h>

VRPIPE_PLUGIN

namespace {
const vrpipe::Registrar<vrpipe::TileCoalescing, vrpipe::TcBehaviour> registrar("tcs", "mine", "for a slot of no GPU");
}
