#pragma once

/// The slots of the pipeline. Each is a *functional model* (a Behaviour): what a unit does and at which rates, without
/// SystemC and without time. Timing models (modules/<unit>/) give it sockets and time; see docs/glossary.md.
///
/// Functional models that turn a stream into batches work by steps: a call takes items until a batch comes out or the
/// items are used up. So one serves a timing model that moves a few quads a cycle and a loop that runs a whole draw.

#include <vrpipe/pipeline/slots/accelerator.h>
#include <vrpipe/pipeline/slots/behaviour.h>
#include <vrpipe/pipeline/slots/binning.h>
#include <vrpipe/pipeline/slots/crop.h>
#include <vrpipe/pipeline/slots/draw.h>
#include <vrpipe/pipeline/slots/memory.h>
#include <vrpipe/pipeline/slots/preparation.h>
#include <vrpipe/pipeline/slots/prop.h>
#include <vrpipe/pipeline/slots/qru.h>
#include <vrpipe/pipeline/slots/raster.h>
#include <vrpipe/pipeline/slots/render.h>
#include <vrpipe/pipeline/slots/sm.h>
#include <vrpipe/pipeline/slots/tc.h>
#include <vrpipe/pipeline/slots/tgc.h>
#include <vrpipe/pipeline/slots/vpo.h>
#include <vrpipe/pipeline/slots/zrop.h>
