#include <gtest/gtest.h>

#include <png.h>

#include <cstdint>
#include <cstdio>
#include <map>
#include <set>

#include <nlohmann/json.hpp>

#include "image/base64.h"
#include "output/plot_fill.h"

#include "tool_test_support.h"

namespace vrpipe {
namespace {

using nlohmann::json;
using testing::Finished;
using testing::read_file;
using CsvRow = std::map<std::string, std::string>;  // cells by column

std::vector<std::string> csv_cells(const std::string& line) {
  std::vector<std::string> cells{""};
  bool quoted = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (line[i] == '"' && quoted && i + 1 < line.size() && line[i + 1] == '"') {
      cells.back() += line[++i];
    } else if (line[i] == '"') {
      quoted = !quoted;
    } else if (line[i] == ',' && !quoted) {
      cells.emplace_back();
    } else {
      cells.back() += line[i];
    }
  }
  return cells;
}

/// The rows of a file that a page has for download.
std::vector<CsvRow> csv_of(const std::string& page, const std::string& name) {
  const std::string start = "<a download=\"" + name + ".csv\" href=\"data:text/csv;base64,";
  const std::size_t found = page.find(start);
  if (found == std::string::npos) return {};
  const std::size_t begin = found + start.size();
  const std::string text = tools::bytes_of_base64(page.substr(begin, page.find('"', begin) - begin));
  std::vector<std::string> heading;
  std::vector<CsvRow> rows;
  for (std::size_t at = 0, end; (end = text.find('\n', at)) != std::string::npos; at = end + 1) {
    const std::vector<std::string> cells = csv_cells(text.substr(at, end - at));
    if (heading.empty()) {
      heading = cells;
      continue;
    }
    EXPECT_EQ(cells.size(), heading.size()) << name;
    CsvRow& row = rows.emplace_back();
    for (std::size_t i = 0; i < std::min(cells.size(), heading.size()); ++i) row[heading[i]] = cells[i];
  }
  return rows;
}

std::vector<CsvRow> rows_of(const std::vector<CsvRow>& rows, const std::string& run) {
  std::vector<CsvRow> own;
  for (const CsvRow& row : rows) {
    if (row.at("run") == run) own.push_back(row);
  }
  return own;
}

/// The page without what its data URIs hold and without its style sheets and scripts.
std::string markup_of(const std::string& page) {
  std::string text;
  for (std::size_t i = 0; i < page.size();) {
    std::size_t end = std::string::npos;
    if (page.compare(i, 5, "data:") == 0) {
      end = page.find('"', i);
    } else if (page.compare(i, 7, "<style>") == 0) {
      end = page.find("</style>", i) + 8;
    } else if (page.compare(i, 8, "<script>") == 0) {
      end = page.find("</script>", i) + 9;
    }
    if (end != std::string::npos) {
      i = end;
    } else {
      text += page[i++];
    }
  }
  return text;
}

/// What is wrong with the nesting of elements; empty for nothing.
std::string nesting_error(const std::string& markup) {
  const std::set<std::string> empty_elements{"!DOCTYPE", "meta", "img", "br", "input"};
  std::vector<std::string> open;
  for (std::size_t at = 0; (at = markup.find('<', at)) != std::string::npos;) {
    const std::size_t end = markup.find('>', at);
    if (end == std::string::npos) return "a tag without end";
    const bool closes = markup[at + 1] == '/';
    const std::size_t name_at = at + (closes ? 2 : 1);
    const std::string name = markup.substr(name_at, markup.find_first_of(" />\n", name_at) - name_at);
    const bool is_single = markup[end - 1] == '/' || empty_elements.count(name) > 0;
    at = end;
    if (closes) {
      if (open.empty() || open.back() != name) return "</" + name + "> in " + (open.empty() ? "nothing" : open.back());
      open.pop_back();
    } else if (!is_single) {
      open.push_back(name);
    }
  }
  return open.empty() ? "" : "never closed: " + open.back();
}

class ComparePage : public testing::ToolTest {
 protected:
  /// Runs the command with --html and --json; gives the page.
  std::string page_of(std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), {"--html", "page.html", "--json", "result.json"});
    const Finished finished = vrpipe(std::move(arguments));
    EXPECT_EQ(finished.code, 0) << finished.err;
    EXPECT_NE(finished.out.find("page: page.html\n"), std::string::npos) << finished.out;
    result_ = json::parse(read_file(folder() / "result.json"), nullptr, false);
    return read_file(folder() / "page.html");
  }

  /// Of any page: it stands alone, and nothing in it is no number.
  void check_whole(const std::string& page) const {
    EXPECT_EQ(page.rfind("<!DOCTYPE html>", 0), 0U);
    const std::string markup = markup_of(page);
    EXPECT_EQ(nesting_error(markup), "");
    EXPECT_EQ(markup.find("nan"), std::string::npos) << markup.substr(markup.find("nan"), 80);
    EXPECT_EQ(markup.find("=\"inf"), std::string::npos);
    std::string without_namespaces = page;
    const std::string svg_namespace = "xmlns=\"http://www.w3.org/2000/svg\"";
    for (std::size_t at; (at = without_namespaces.find(svg_namespace)) != std::string::npos;) {
      without_namespaces.erase(at, svg_namespace.size());
    }
    for (const char* from_elsewhere : {"http://", "https://", "@import", "<link", "src=\"/"}) {
      EXPECT_EQ(without_namespaces.find(from_elsewhere), std::string::npos) << from_elsewhere;
    }
    for (const json& run : result_["runs"]) {
      EXPECT_NE(markup.find(">" + run["name"].get<std::string>() + "<"), std::string::npos);
    }
  }

  json result_;
};

TEST_F(ComparePage, StandsAloneAndNamesEveryRunAndSection) {
  const std::string page = page_of({"compare", "--scene", "tiny.spl", "--energy"});
  check_whole(page);
  for (const char* section :
       {"pictures", "speedups", "fates", "states", "course", "heat", "spent", "effects", "notes", "settings"}) {
    EXPECT_NE(page.find(std::string("<section id=\"") + section + "\">"), std::string::npos) << section;
  }
}

TEST_F(ComparePage, NumbersAreThoseOfTheJson) {
  const std::string page = page_of({"compare", "--scene", "tiny.spl", "--energy"});
  for (const json& run : result_["runs"]) {
    const std::string name = run["name"];
    SCOPED_TRACE(name);
    const auto one = [&](const char* file) {
      const std::vector<CsvRow> rows = rows_of(csv_of(page, file), name);
      EXPECT_EQ(rows.size(), 1U) << file;
      return rows.empty() ? CsvRow{} : rows.front();
    };
    CsvRow time = one("speedup");
    EXPECT_EQ(time["cycles"], run["cycles"].dump());
    EXPECT_EQ(std::stod(time["milliseconds"]), run["milliseconds"].get<double>());
    EXPECT_EQ(time["result_hash"], run["result_hash"]);
    EXPECT_EQ(time["bottleneck"], run["bottleneck"]["unit"]);
    if (result_["speedup"].contains(name)) {
      EXPECT_EQ(std::stod(time["speedup"]), result_["speedup"][name].get<double>());
    }
    for (const char* file : {"quads", "fragments"}) {
      CsvRow counts = one(file);
      for (const auto& [key, value] : run["counts"].items()) EXPECT_EQ(counts[key], value.dump()) << key;
    }
    CsvRow utilization = one("utilization");
    for (const auto& [unit, share] : run["utilization"].items()) {
      EXPECT_EQ(std::stod(utilization[unit]), share.get<double>()) << unit;
    }
    const std::vector<CsvRow> states = rows_of(csv_of(page, "cycles"), name);
    ASSERT_EQ(states.size(), run["units"].size());
    for (std::size_t i = 0; i < states.size(); ++i) {
      const json& unit = run["units"][i];
      EXPECT_EQ(states[i].at("unit"), unit["name"]);
      for (const auto& [state, cycles] : unit["cycles"].items()) EXPECT_EQ(states[i].at(state), cycles.dump());
    }
    const std::vector<CsvRow> energy = rows_of(csv_of(page, "energy"), name);
    double spent = 0;
    for (const CsvRow& row : energy) spent += std::stod(row.at("nominal_mj"));
    EXPECT_NEAR(spent, run["energy"]["total_millijoules"]["nominal"].get<double>(), 1e-9 + 1e-6 * spent);
    for (const CsvRow& row : rows_of(csv_of(page, "heat"), name)) {
      if (row.at("map") == "termination_cycle") continue;
      EXPECT_EQ(row.at("sum"), run["counts"]["fragments_" + row.at("map")].dump()) << row.at("map");
    }
  }
  const std::vector<CsvRow> parameters = csv_of(page, "parameters");
  std::map<std::string, CsvRow> by_name;
  for (const CsvRow& row : parameters) by_name[row.at("parameter")] = row;
  for (const auto& [key, value] : result_["platform"]["parameters"].items()) {
    const std::string text = value.is_string()    ? value.get<std::string>()
                             : value.is_boolean() ? (value.get<bool>() ? "on" : "off")
                                                  : value.dump();
    EXPECT_EQ(by_name[key]["value"], text) << key;
    EXPECT_EQ(by_name[key]["origin"], result_["platform"]["origins"][key]) << key;
  }
}

TEST_F(ComparePage, TheCourseSumsToTheStatesOfTheRun) {
  const std::string page = page_of({"compare", "--scene", "tiny.spl", "--interval", "64"});
  const std::vector<CsvRow> course = csv_of(page, "states-over-time");
  for (const json& run : result_["runs"]) {
    std::map<std::string, double> busy;
    double last = 0;
    for (const CsvRow& row : rows_of(course, run["name"])) {
      const double length = std::stod(row.at("to")) - std::stod(row.at("from"));
      busy[row.at("unit")] += length * std::stod(row.at("busy"));
      last = std::max(last, std::stod(row.at("to")));
    }
    EXPECT_EQ(last, run["cycles"].get<double>());
    for (const json& unit : run["units"]) {
      const std::string name = unit["name"];
      EXPECT_NEAR(busy[name.substr(name.rfind('.') + 1)], unit["cycles"]["busy"].get<double>(), 0.5) << name;
    }
    EXPECT_TRUE(run.contains("intervals"));
  }
}

TEST_F(ComparePage, LeavesTheJsonAsItIs) {
  page_of({"compare", "--scene", "tiny.spl"});
  const json with = result_;
  json without = json_of({"compare", "--scene", "tiny.spl"});
  for (std::size_t i = 0; i < without["runs"].size(); ++i) {
    EXPECT_FALSE(with["runs"][i].contains("intervals"));
    // What is looked at stays, also the units that the run could be without: units and statistics may be more.
    for (const char* key : {"result_hash", "cycles", "counts", "parameters", "images"}) {
      EXPECT_TRUE(with["runs"][i][key] == without["runs"][i][key]) << i << " " << key;
    }
  }
}

TEST_F(ComparePage, MarksWhatDiffersAndEscapesNames) {
  std::filesystem::copy(folder() / "tiny.spl", folder() / "<b>&.spl");
  const std::string page = page_of({"compare", "--scene", "<b>&.spl", "--variant", "baseline", "--variant",
                                    "small=het+qm,tc.bins=16", "--set", "crop.cache_bytes=8192"});
  check_whole(page);
  EXPECT_EQ(page.find("<b>&"), std::string::npos);
  EXPECT_NE(page.find("<title>vrpipe compare: &lt;b&gt;&amp;.spl</title>"), std::string::npos);
  EXPECT_NE(page.find("<td class=\"other\">small: 16</td>"), std::string::npos);
  EXPECT_NE(page.find("<td class=\"active\">command line</td>"), std::string::npos);
  for (const CsvRow& row : csv_of(page, "parameters")) {
    if (row.at("parameter") == "tc.bins") {
      EXPECT_EQ(row.at("small"), "16");
    }
  }
}

TEST_F(ComparePage, OfOneRunWithoutTimeOrWithSeveralPlatforms) {
  check_whole(page_of({"run", "--scene", "tiny.spl"}));
  const std::string functional = page_of({"run", "--scene", "tiny.spl", "--fidelity", "functional"});
  check_whole(functional);
  EXPECT_EQ(functional.find("<section id=\"course\">"), std::string::npos);
  EXPECT_EQ(functional.find("<section id=\"states\">"), std::string::npos);
  EXPECT_NE(functional.find("<section id=\"heat\">"), std::string::npos);
  const std::string two = page_of({"compare", "--scene", "tiny.spl", "--platform", "agx-orin-ideal-memory",
                                   "--platform", "mobile", "--fidelity", "lt", "--relative-to", "mobile/baseline"});
  check_whole(two);
  EXPECT_NE(two.find("speed-up over mobile/baseline"), std::string::npos);
}

TEST_F(ComparePage, OfNothingVisibleIsStillAPage) {
  Draw draw = testing::tiny_draw();
  for (Splat& splat : draw.splats) splat.cx = -1000;
  write_draw_list(folder() / "away.spl", draw);
  const std::string page = page_of({"compare", "--scene", "away.spl"});
  check_whole(page);
  EXPECT_NE(page.find("Nothing is visible."), std::string::npos);
}

TEST_F(ComparePage, RefusesWhatItCannotDo) {
  refused({"compare", "--scene", "tiny.spl", "--html", "none/page.html"}, {"--html none/page.html"});
  refused({"compare", "--scene", "tiny.spl", "--html", "tiny.spl"}, {"--html", "is the same file"});
  refused({"run", "--scene", "tiny.spl", "--html", "x", "--json", "x"}, {"--html", "--json"});
  refused({"compare", "--views", "2", "--html", "page.html"}, {"--html", "--views"});
}

TEST(PlotFills, DifferInGrey) {
  for (std::size_t a = 0; a < tools::plot_fills.size(); ++a) {
    for (std::size_t b = 0; b < a; ++b) {
      const auto& [color, hatch] = tools::plot_fills[a];
      const double difference = std::abs(tools::lightness(color) - tools::lightness(tools::plot_fills[b].color));
      EXPECT_GE(difference, 6) << color;
      if (difference < 12) {
        EXPECT_NE(hatch, tools::plot_fills[b].hatch) << color;
      }
    }
  }
  std::set<std::size_t> of_states;
  for (unsigned state = 0; state < unit_states; ++state)
    of_states.insert(tools::fill_of(static_cast<UnitState>(state)));
  EXPECT_EQ(of_states.size(), unit_states);
  EXPECT_NEAR(tools::lightness("#ffffff"), 100, 1e-3);
  EXPECT_NEAR(tools::lightness("#777777"), 50, 0.5);
}

/// What a command prints, of which stderr is dropped.
std::string output_of(const std::string& command) {
  FILE* const pipe = ::popen((command + " 2>/dev/null").c_str(), "r");
  std::string text;
  if (pipe == nullptr) return text;
  for (int c; (c = std::fgetc(pipe)) != EOF;) text += static_cast<char>(c);
  ::pclose(pipe);
  return text;
}

std::string browser() {
  for (const char* name : {"chromium", "chromium-browser", "google-chrome"}) {
    std::string path = output_of(std::string("command -v ") + name);
    if (!path.empty()) return path.substr(0, path.find('\n'));
  }
  return {};
}

/// How many colours a picture has.
std::size_t colors_of(const std::filesystem::path& file) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  if (png_image_begin_read_from_file(&image, file.c_str()) == 0) return 0;
  image.format = PNG_FORMAT_RGB;
  std::vector<std::uint8_t> bytes(PNG_IMAGE_SIZE(image));
  if (png_image_finish_read(&image, nullptr, bytes.data(), 0, nullptr) == 0) return 0;
  std::set<std::uint32_t> colors;
  for (std::size_t i = 0; i + 2 < bytes.size(); i += 3) {
    colors.insert(bytes[i] << 16U | bytes[i + 1] << 8U | bytes[i + 2]);
  }
  return colors.size();
}

std::string attribute(const std::string& page, const std::string& name) {
  const std::string element = page.substr(page.find("<html"), page.find('>', page.find("<html")) - page.find("<html"));
  const std::string start = "data-" + name + "=\"";
  const std::size_t found = element.find(start);
  if (found == std::string::npos) return {};
  return element.substr(found + start.size(), element.find('"', found + start.size()) - found - start.size());
}

TEST_F(ComparePage, IsDrawnByABrowser) {
  const std::string program = browser();
  if (program.empty()) GTEST_SKIP() << "no chromium, chromium-browser or google-chrome";
  const std::string page = page_of({"compare", "--scene", "tiny.spl", "--energy"});
  const std::string command = program +
                              " --headless=new --no-sandbox --disable-gpu --disable-dev-shm-usage "
                              "--user-data-dir=" +
                              (folder() / "profile").string() + " ";
  const std::string address = "file://" + (folder() / "page.html").string();
  const std::string drawn = output_of(command + "--dump-dom " + address);
  ASSERT_NE(drawn.find("<html"), std::string::npos) << program << " prints no page";
  EXPECT_EQ(attribute(drawn, "error"), "");
  EXPECT_EQ(attribute(drawn, "ready"), "true");
  EXPECT_EQ(attribute(drawn, "pictures"), "4");
  EXPECT_EQ(attribute(drawn, "plots"), "6");
  EXPECT_GE(std::atoi(attribute(drawn, "maps").c_str()), 4);
  // The script has compared the pictures of the two runs that are chosen at first.
  EXPECT_NE(drawn.find("data-largest="), std::string::npos);
  output_of(command + "--hide-scrollbars --window-size=1100,2400 --screenshot=" + (folder() / "page.png").string() +
            " " + address);
  EXPECT_GT(colors_of(folder() / "page.png"), 100U);
}

}  // namespace
}  // namespace vrpipe
