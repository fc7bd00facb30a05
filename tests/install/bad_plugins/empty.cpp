#include <vrpipe/registry.h>

VRPIPE_PLUGIN
