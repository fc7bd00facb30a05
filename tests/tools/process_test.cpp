#include <fcntl.h>
#include <pty.h>
#include <sys/resource.h>

#include <csignal>
#include <regex>
#include <stdexcept>

#include <vrpipe/pipeline/registry.h>
#include <vrpipe/platforms/simulation.h>

#include "cli/command_line.h"
#include "file_io.h"
#include "forked.h"
#include "host/output_file.h"
#include "host/process_setup.h"
#include "jobs/journal.h"
#include "qru/qru.h"

namespace vrpipe::testing {
namespace {

using tools::set_up_process;
using tools::write_output_file;

/// The program, whoever starts it, and however it ends.
class Process : public ToolTest {
 protected:
  Finished forked(const std::function<int()>& act) const { return in_fork(folder(), act); }

  /// The command with a QRU that this process brings, as a plugin would.
  Finished with_unit(Implementation unit, std::vector<const char*> arguments) const {
    arguments.insert(arguments.begin(), "vrpipe");
    unit.trust = Trust::checked;
    return forked([&] {
      fresh_simulation();
      Registry::instance().add(unit);
      return tools::run_command_line(static_cast<int>(arguments.size()), arguments.data());
    });
  }
};

TEST_F(Process, AMistakeIsExitCode2WithoutAnyoneToTell) {
  const Finished closed = forked([] {
    ::close(STDERR_FILENO);
    return become_vrpipe({"run", "--scene", "nope.ply"});
  });
  EXPECT_EQ(closed.code, 2);
  EXPECT_EQ(closed.out, "");
  const Finished full = forked([] {
    ::dup2(::open("/dev/full", O_WRONLY), STDERR_FILENO);
    return become_vrpipe({"run", "--scene", "nope.ply"});
  });
  EXPECT_EQ(full.code, 2);
}

TEST_F(Process, WithoutStandardStreamsFilesAreWholeAndTheLostReportIsAMistake) {
  const Finished finished = forked([] {
    ::close(STDIN_FILENO);
    ::close(STDOUT_FILENO);
    return become_vrpipe({"compare", "--scene", "tiny.spl", "--json", "r.json"});
  });
  EXPECT_EQ(finished.code, 2);
  EXPECT_EQ(finished.err.rfind("vrpipe: error: cannot write results (stdout)", 0), 0U) << finished.err;
  EXPECT_EQ(std::count(finished.err.begin(), finished.err.end(), '\n'), 1) << finished.err;
  EXPECT_EQ(nlohmann::json::parse(read_file(folder() / "r.json"))["runs"].size(), 4U);
  EXPECT_EQ(finished.out, "");
}

TEST_F(Process, WhatAPluginPrintsIsNoResult) {
  Implementation chatty = Registry::instance().find("qru", "pairing");
  chatty.name = "chatty";
  chatty.make_behaviour = [make = chatty.make_behaviour](const ParameterSet& parameters, const RenderContext& context) {
    std::puts("here I am");
    std::cout << "and here\n";
    return make(parameters, context);
  };
  for (const std::vector<const char*>& command : {std::vector<const char*>{"units"},
                                                  {"run", "--scene", "tiny.spl", "--unit", "qru=chatty"},
                                                  {"compare", "--scene", "tiny.spl", "--unit", "qru=chatty"}}) {
    std::vector<const char*> arguments = command;
    arguments.insert(arguments.end(), {"--json", "-"});
    const Finished finished = with_unit(chatty, arguments);
    EXPECT_EQ(finished.code, 0) << finished.err;
    EXPECT_TRUE(nlohmann::json::accept(finished.out)) << finished.out.substr(0, 200);
    EXPECT_NE(finished.err.find("here I am"), std::string::npos);
  }
  const Finished report = with_unit(chatty, {"run", "--scene", "tiny.spl", "--unit", "qru=chatty"});
  EXPECT_EQ(report.out.find("here"), std::string::npos) << report.out;
}

TEST_F(Process, APointThatEndsInAFaultIsARowAndTheOthersAreDone) {
  struct Faulty : PairingQru {
    using PairingQru::PairingQru;
    unsigned examine(TileId, const Quad*, unsigned, Warp&, bool&) override {
      throw std::runtime_error("no idea, really");
    }
  };
  Implementation faulty = Registry::instance().find("qru", "pairing");
  faulty.name = "faulty";
  faulty.make_behaviour = [](const ParameterSet& parameters, const RenderContext& context) {
    return std::make_unique<Faulty>(dynamic_cast<const PairingQru::Parameters&>(parameters), context);
  };
  write("study.toml",
        "scene = \"tiny.spl\"\nfidelity = \"lt\"\n[variants.bad]\nbase = \"qm\"\nunit.qru = \"faulty\"\n"
        "[axes]\nvariant = [\"baseline\", \"bad\", \"qm\"]\n");
  std::string before;
  for (const char* done : {"", "3 of 3 points were done before"}) {
    const Finished finished = with_unit(faulty, {"sweep", "study.toml", "--journal", "j.jsonl", "--csv", "points.csv"});
    EXPECT_EQ(finished.code, 1);
    EXPECT_NE(finished.err.find(done), std::string::npos) << finished.err;
    EXPECT_NE(finished.err.find("1 of 3 points ended in a fault"), std::string::npos) << finished.err;
    EXPECT_NE(finished.out.find("on the Pareto front"), std::string::npos) << finished.out;
    const std::string points = read_file(folder() / "points.csv");
    EXPECT_TRUE(std::regex_search(points, std::regex("\n1,bad,,,.*,\"?.*no idea, really"))) << points;
    EXPECT_TRUE(std::regex_search(points, std::regex("\n2,qm,[0-9]+,[0-9.]+,[0-9.]+"))) << points;
    EXPECT_TRUE(before.empty() || points == before) << points;
    before = points;
  }
}

TEST_F(Process, ForeignBytesOfAPluginAreEscaped) {
  Implementation foreign = Registry::instance().find("qru", "pairing");
  foreign.name = "foreign";
  foreign.description = "caf\xe9 \x1b[2J";
  const Finished listed = with_unit(foreign, {"units", "--slot", "qru", "--json", "-"});
  EXPECT_EQ(listed.code, 0) << listed.err;
  EXPECT_NE(listed.out.find(R"("caf\\xE9 \u001b[2J")"), std::string::npos) << listed.out;
  for (const auto& options : {std::vector<const char*>{}, {"--markdown"}}) {
    std::vector<const char*> arguments{"units", "--slot", "qru"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    const std::string text = with_unit(foreign, arguments).out;
    EXPECT_NE(text.find("caf\\xE9 \\x1B[2J"), std::string::npos) << text;
    EXPECT_EQ(text.find('\x1b'), std::string::npos) << text;
  }
}

TEST_F(Process, AnInterruptionSaysWhatWasWrittenAndLeavesNothingElse) {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    const Finished nothing = forked([&] {
      set_up_process();
      AtomicFile unfinished("unfinished", "cannot write file", "x");
      return ::raise(signal);
    });
    EXPECT_EQ(nothing.code, 128 + signal);
    EXPECT_EQ(nothing.err, "vrpipe: interrupted, nothing written\n");
    EXPECT_EQ(files(), (std::vector<std::string>{"tiny.spl"}));
  }
  const Finished some = forked([] {
    set_up_process();
    for (const char* name : {"a", "b\n", "c", "d", "e", "f"}) write_output_file(name, "text", "--json");
    AtomicFile unfinished("a", "cannot write file", "x");
    tools::note_progress_line(true);
    return ::raise(SIGTERM);
  });
  EXPECT_EQ(some.code, 128 + SIGTERM);
  EXPECT_EQ(some.err, "\r\x1b[Jvrpipe: interrupted; written: a, b\\n, c, d and 2 more\n");
  EXPECT_EQ(files(), (std::vector<std::string>{"a", "b\n", "c", "d", "e", "f", "tiny.spl"}));
  EXPECT_EQ(read_file(folder() / "a"), "text");
  const Finished journal = forked([] {
    set_up_process();
    tools::Journal::in_file("j.jsonl", {{"schema", "some"}}, "--journal");
    return ::raise(SIGINT);
  });
  EXPECT_EQ(journal.err, "vrpipe: interrupted; written: j.jsonl; the same command goes on from there\n");
}

TEST_F(Process, AnInterruptedChildLeavesItsParentsFilesAlone) {
  const Finished finished = forked([] {
    set_up_process();
    AtomicFile file("a", "cannot write file", "x");
    const pid_t child = ::fork();
    if (child == 0) ::raise(SIGTERM);
    int status = 0;
    ::waitpid(child, &status, 0);
    file.commit();
    return WIFSIGNALED(status) ? WTERMSIG(status) : 0;
  });
  EXPECT_EQ(finished.code, SIGTERM);
  EXPECT_EQ(finished.err, "");
  EXPECT_EQ(files(), (std::vector<std::string>{"a", "tiny.spl"}));
}

TEST_F(Process, AnIgnoredSignalStaysIgnored) {
  const Finished finished = forked([] {
    ::signal(SIGHUP, SIG_IGN);  // nohup
    set_up_process();
    return ::raise(SIGHUP) == 0 ? 7 : 1;
  });
  EXPECT_EQ(finished.code, 7);
  EXPECT_EQ(finished.err, "");
}

TEST_F(Process, InterruptedAtATerminalItErasesItsProgress) {
  int master = -1;
  int slave = -1;
  ASSERT_EQ(::openpty(&master, &slave, nullptr, nullptr, nullptr), 0);
  const pid_t process = ::fork();
  if (process == 0) {
    ::setenv("TERM", "xterm", 1);
    ::dup2(slave, STDERR_FILENO);
    ::dup2(::open("/dev/null", O_WRONLY), STDOUT_FILENO);
    ::_exit(become_vrpipe({"compare", "--scene", "builtin:indoor"}));
  }
  ::close(slave);
  std::string drawn;
  char buffer[4096];
  bool interrupted = false;
  for (ssize_t count; (count = ::read(master, buffer, sizeof buffer)) > 0;) {
    drawn.append(buffer, static_cast<std::size_t>(count));
    if (interrupted || drawn.find('%') == std::string::npos) continue;
    interrupted = true;
    ::kill(process, SIGINT);
  }
  ::close(master);
  int status = 0;
  ::waitpid(process, &status, 0);
  ASSERT_TRUE(WIFSIGNALED(status)) << drawn;
  EXPECT_EQ(WTERMSIG(status), SIGINT);
  const std::string end = "\r\x1b[Jvrpipe: interrupted, nothing written\r\n";
  ASSERT_GE(drawn.size(), end.size());
  EXPECT_EQ(drawn.substr(drawn.size() - end.size()), end);
}

TEST_F(Process, WithFewerDescriptorsFewerSimulationsRunAtATime) {
  const Finished finished = forked([] {
    ::closefrom(3);            // whatever the tests were started with
    const rlimit limit{5, 5};  // 0 to 2, and the pipe of one simulation
    ::setrlimit(RLIMIT_NOFILE, &limit);
    return become_vrpipe({"compare", "--scene", "tiny.spl", "--jobs", "4"});
  });
  EXPECT_EQ(finished.code, 0) << finished.err;
  EXPECT_EQ(finished.err, "");
}

#ifndef VRPIPE_SANITIZED  // by what needs all addresses there are
TEST_F(Process, WithoutMemoryForItsBinsItSaysWhatToLower) {
  const Finished finished = forked([] {
    const rlimit limit{std::size_t{600} << 20U, std::size_t{600} << 20U};
    ::setrlimit(RLIMIT_AS, &limit);
    return become_vrpipe(
        {"run", "--scene", "tiny.spl", "--set", "tgc.bins=65536", "--set", "tgc.bin_primitives=65536"});
  });
  EXPECT_EQ(finished.code, 1);
  EXPECT_EQ(finished.err.rfind("vrpipe: fault: out of memory; try ", 0), 0U) << finished.err;
  EXPECT_NE(finished.err.find("bins where --set made them larger"), std::string::npos) << finished.err;
}
#endif

TEST_F(Process, AFileThatOutgrowsItsLimitIsAMistake) {
  const Finished finished = forked([] {
    const rlimit limit{1000, 1000};
    ::setrlimit(RLIMIT_FSIZE, &limit);
    return become_vrpipe({"run", "--scene", "tiny.spl", "--save-draw", "d.spl"});
  });
  EXPECT_EQ(finished.code, 2);
  EXPECT_NE(finished.err.find("d.spl): File too large; raise the limit"), std::string::npos) << finished.err;
  EXPECT_EQ(files(), (std::vector<std::string>{"tiny.spl"}));
}

}  // namespace
}  // namespace vrpipe::testing
