#include "walk/isolated.h"

#include <poll.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <sstream>
#include <system_error>

#include <fmt/format.h>

namespace vrpipe::walk {

namespace {

[[noreturn]] void system_failure(const char* what) { throw std::system_error(errno, std::generic_category(), what); }

/// Writes a line for each stage, `@NAME`, and for each finding, `RULE<tab>DETAIL`.
class PipeVerdict : public Verdict {
 public:
  explicit PipeVerdict(int pipe) : pipe_(pipe) {}
  void stage(const std::string& name) override { write("@" + name); }
  void finding(const Finding& finding) override { write(finding.rule + "\t" + finding.detail); }

 private:
  void write(std::string line) {
    for (char& c : line) c = c == '\n' ? ' ' : c;
    line += '\n';
    for (std::size_t done = 0; done < line.size();) {
      const ssize_t count = ::write(pipe_, line.data() + done, line.size() - done);
      if (count < 0) ::_exit(3);
      done += static_cast<std::size_t>(count);
    }
  }
  int pipe_;
};

void limit(decltype(RLIMIT_AS) resource, std::uint64_t value) {
  const rlimit both{value, value};
  if (::setrlimit(resource, &both) != 0) ::_exit(3);
}

[[noreturn]] void be_the_child(const Case& c, const Limits& limits, int pipe) {
  limit(RLIMIT_CORE, 0);
  limit(RLIMIT_CPU, limits.seconds);
#if !defined(VRPIPE_SHADOW_MEMORY)
  limit(RLIMIT_AS, limits.bytes);
#endif
  PipeVerdict verdict(pipe);
  try {
    judge(c, verdict);
  } catch (const std::exception& error) {
    verdict.finding({"a fault", error.what()});
  }
  ::_exit(0);
}

/// All that comes through the pipe until its other end closes or time is up.
std::string read_all(int pipe, std::chrono::seconds patience) {
  const auto end = std::chrono::steady_clock::now() + patience;
  std::string text;
  std::array<char, 4096> buffer;
  for (;;) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(end - std::chrono::steady_clock::now());
    pollfd wait{pipe, POLLIN, 0};
    if (left.count() <= 0 || ::poll(&wait, 1, static_cast<int>(left.count())) <= 0) return text;
    const ssize_t count = ::read(pipe, buffer.data(), buffer.size());
    if (count <= 0) return text;
    text.append(buffer.data(), static_cast<std::size_t>(count));
  }
}

}  // namespace

std::vector<Finding> judged_apart(const Case& c, const Limits& limits) {
  std::array<int, 2> ends;
  if (::pipe(ends.data()) != 0) system_failure("pipe");
  const pid_t child = ::fork();
  if (child < 0) system_failure("fork");
  if (child == 0) {
    ::close(ends[0]);
    be_the_child(c, limits, ends[1]);
  }
  ::close(ends[1]);
  const std::string text = read_all(ends[0], std::chrono::seconds(5 * limits.seconds));
  ::close(ends[0]);
  ::kill(child, SIGKILL);  // one that has ended is only a zombie by now
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {}

  std::vector<Finding> findings;
  std::string stage = "the start";
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (line[0] == '@') {
      stage = line.substr(1);
    } else {
      const std::size_t tab = line.find('\t');
      findings.push_back({line.substr(0, tab), line.substr(tab + 1)});
    }
  }
  if (WIFSIGNALED(status)) {
    const bool hung = WTERMSIG(status) == SIGXCPU || WTERMSIG(status) == SIGKILL;
    findings.push_back({hung ? "a hang" : "a crash", fmt::format("{}: ended by signal {} ({})", stage, WTERMSIG(status),
                                                                 ::strsignal(WTERMSIG(status)))});
  } else if (WEXITSTATUS(status) != 0) {
    findings.push_back({"a crash", fmt::format("{}: ended with {}", stage, WEXITSTATUS(status))});
  }
  return findings;
}

}  // namespace vrpipe::walk
