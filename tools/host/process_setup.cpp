#include "host/process_setup.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <deque>
#include <mutex>
#include <vector>

#include <fmt/format.h>

#include <vrpipe/component/printable.h>

#include "file_io.h"

namespace vrpipe::tools {
namespace {

// The handler may run at any time, so what it reads is complete at any time: texts that are never changed or freed.
std::atomic<const char*> last_words{"vrpipe: interrupted, nothing written\n"};
std::atomic<bool> progress_is_drawn{false};
std::atomic<pid_t> owner{0};

void say_to_terminal(const char* text) {
  if (::write(STDERR_FILENO, text, std::strlen(text)) < 0) return;  // nobody is left to be told
}

void end_in_order(int signal) {
  if (::getpid() == owner) {
    remove_unfinished_files();
    if (progress_is_drawn) say_to_terminal("\r\x1b[J");
    say_to_terminal(last_words);
  }
  // Delivered when the handler returns: whoever waits for the process sees which signal ended it.
  ::signal(signal, SIG_DFL);
  ::raise(signal);
}

void open_standard_streams() {
  for (const int descriptor : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (::fcntl(descriptor, F_GETFD) != -1 || errno != EBADF) continue;
    // Opened for what is never done with it: as with a closed one, what is written is not lost unseen.
    if (::open("/dev/null", descriptor == STDIN_FILENO ? O_WRONLY : O_RDONLY) != descriptor) return;
  }
}

}  // namespace

void set_up_process() {
  open_standard_streams();
  ::signal(SIGXFSZ, SIG_IGN);
  owner = ::getpid();
  struct sigaction action {};
  action.sa_handler = end_in_order;
  ::sigfillset(&action.sa_mask);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    struct sigaction before {};
    ::sigaction(signal, nullptr, &before);
    if (before.sa_handler == SIG_DFL) ::sigaction(signal, &action, nullptr);
  }
}

void note_written(const std::string& path, bool goes_on) {
  static std::mutex mutex;
  static std::vector<std::string> files;
  static bool has_journal = false;
  static auto& texts = *new std::deque<std::string>;
  const std::lock_guard<std::mutex> lock(mutex);
  files.push_back(printable(path));
  has_journal = has_journal || goes_on;
  constexpr std::size_t most = 4;
  const std::size_t named = std::min(files.size(), most);
  std::string list =
      fmt::format("{}", fmt::join(files.begin(), files.begin() + static_cast<std::ptrdiff_t>(named), ", "));
  if (files.size() > most) list += fmt::format(" and {} more", files.size() - most);
  texts.push_back("vrpipe: interrupted; written: " + list +
                  (has_journal ? "; the same command goes on from there\n" : "\n"));
  last_words = texts.back().c_str();
}

void note_progress_line(bool is_drawn) { progress_is_drawn = is_drawn; }

}  // namespace vrpipe::tools
