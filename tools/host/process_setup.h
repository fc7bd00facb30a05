#pragma once

#include <string>

namespace vrpipe::tools {

// What the program needs of its process, whoever started it and however it ends.

/// To be called first.
/// Descriptors 0 to 2 are open afterwards: one that was closed fails as before, but no file or pipe gets its number.
/// SIGINT, SIGTERM and SIGHUP, unless they are ignored, erase the progress line, remove unfinished files, say in one line
/// what had been written, and end the process by that signal. A forked process they end at once.
/// A file that outgrows its limit is an error of writing, not the end by SIGXFSZ.
void set_up_process();

/// For that line: a file that is complete, or, if the same command `goes_on` from it, a journal.
void note_written(const std::string& path, bool goes_on = false);

/// For that line: whether a progress line stands on the terminal.
void note_progress_line(bool is_drawn);

}  // namespace vrpipe::tools
