#include "host/crash_report.h"

#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <initializer_list>

#include <vrpipe/pipeline/checked_behaviours.h>
#include <vrpipe/pipeline/registry.h>

#include "host/command_failure.h"

namespace vrpipe::tools {
namespace {

// A signal handler may not allocate: what it writes is ready before.
struct Report {
  int descriptor = STDERR_FILENO;
  int exit_code = exit_fault;
  char prefix[256] = {};
  char suffix[64] = {};
  char plugins[1024] = {};
};
Report report;

template <std::size_t Size>
void keep(char (&buffer)[Size], const std::string& text) {
  const std::size_t length = std::min(text.size(), Size - 1);
  std::memcpy(buffer, text.data(), length);
  buffer[length] = '\0';
}

void write_text(const char* text) {
  if (text == nullptr) return;
  for (std::size_t left = std::strlen(text); left > 0;) {
    const ssize_t count = ::write(report.descriptor, text, left);
    if (count <= 0) return;
    text += count;
    left -= static_cast<std::size_t>(count);
  }
}

[[noreturn]] void end_with(std::initializer_list<const char*> what) {
  const ForeignCode code = foreign_code_running();
  write_text(report.prefix);
  if (code.owner != nullptr) {
    write_text(code.owner);
    write_text(", ");
    write_text(code.call);
    write_text(": ");
  }
  for (const char* part : what) write_text(part);
  write_text(report.plugins);
  write_text(report.suffix);
  ::_exit(report.exit_code);
}

void on_signal(int signal) {
  const char number[] = {static_cast<char>('0' + signal / 10), static_cast<char>('0' + signal % 10), '\0'};
  end_with({"ended by signal ", signal < 10 ? number + 1 : number, " (", ::sigdescr_np(signal), ")"});
}

void on_exit() {
  if (foreign_code_running().owner != nullptr) end_with({"calls exit()"});
}

[[noreturn]] void on_terminate() {
  std::string detail = "an exception of unknown type";
  try {
    if (const std::exception_ptr thrown = std::current_exception()) std::rethrow_exception(thrown);
  } catch (const std::exception& exception) {
    detail = exception.what();
    std::replace(detail.begin(), detail.end(), '\n', ' ');
  } catch (...) {}
  end_with({"throws, and nothing catches it: ", detail.c_str()});
}

void install() {
  // A stack of its own, for a handler of a stack overflow.
  static char stack[65536];
  stack_t alternative = {};
  alternative.ss_sp = stack;
  alternative.ss_size = sizeof stack;
  ::sigaltstack(&alternative, nullptr);
  struct sigaction action = {};
  action.sa_handler = on_signal;
  action.sa_flags = static_cast<int>(SA_ONSTACK | SA_RESETHAND);
  for (const int signal : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT}) ::sigaction(signal, &action, nullptr);
  std::set_terminate(on_terminate);
  std::atexit(on_exit);
}

void prepare(int descriptor, const std::string& prefix, const std::string& suffix, int exit_code) {
  report.descriptor = descriptor;
  report.exit_code = exit_code;
  keep(report.prefix, prefix);
  keep(report.suffix, suffix);
  std::string plugins;
  for (const std::string& path : loaded_plugins()) plugins += (plugins.empty() ? "; plugins: " : ", ") + path;
  keep(report.plugins, plugins);
  [[maybe_unused]] static const bool installed = [] {
    install();
    return true;
  }();
}

}  // namespace

void report_crashes(const std::string& where) { prepare(STDERR_FILENO, "vrpipe: fault: " + where, "\n", exit_fault); }

void report_crashes_to(int descriptor, char mark) { prepare(descriptor, std::string(1, mark), "", 0); }

}  // namespace vrpipe::tools
