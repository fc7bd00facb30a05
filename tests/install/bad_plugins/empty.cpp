#include <vrpipe/pipeline/registry.h>

VRPIPE_PLUGIN
