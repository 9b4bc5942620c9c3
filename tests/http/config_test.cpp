#include "server/daemon/config.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdio>
#include <fstream>

namespace {

using whittled::ConfigError;
using whittled::Environment;
using whittled::Task;

/// Removed with the object.
class TemporaryFile {
 public:
  explicit TemporaryFile(const std::string& text) : path_(testing::TempDir() + "whittle-" + std::to_string(getpid())) {
    std::ofstream(path_) << text;
  }
  ~TemporaryFile() { std::remove(path_.c_str()); }
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  std::string path_;
};

whittled::Config accepted(const std::vector<std::string>& arguments, const Environment& environment = {}) {
  const auto command = whittled::read_command(arguments, environment);
  if (!command) {
    for (const auto& [where, sentence] : command.error()) ADD_FAILURE() << where << ": " << sentence;
    return {};
  }
  return command->config;
}

std::vector<ConfigError> errors(const std::vector<std::string>& arguments, const Environment& environment = {}) {
  const auto command = whittled::read_command(arguments, environment);
  if (command) {
    ADD_FAILURE() << "accepted";
    return {};
  }
  return command.error();
}

std::string places(const std::vector<ConfigError>& all) {
  std::string text;
  for (const ConfigError& error : all) text += error.where + ' ';
  return text;
}

void expect_error(const std::vector<std::string>& arguments, const std::string& where, const std::string& part) {
  SCOPED_TRACE(testing::PrintToString(arguments));
  const auto all = errors(arguments);
  ASSERT_EQ(all.size(), 1U) << places(all);
  EXPECT_EQ(all[0].where, where);
  EXPECT_NE(all[0].sentence.find(part), std::string::npos) << all[0].sentence;
}

TEST(Config, HasDefaults) {
  const auto config = accepted({});
  EXPECT_EQ(config.listen, (whittled::Address{"127.0.0.1", 8080}));
  EXPECT_EQ(config.health_listen, (whittled::Address{"127.0.0.1", 8081}));
  EXPECT_EQ(config.data, "./data");
  EXPECT_EQ(config.assets, "");
  EXPECT_EQ(config.render_wait_s, 60U);
  EXPECT_EQ(config.log_level, "info");
}

TEST(Config, PrefersFlagOverEnvironmentOverFile) {
  const TemporaryFile file("# a comment\n\n  jobs = 3   # and its reason\nlog_level=debug\r\nrender_wait_s = 7\n");
  const Environment environment{{"WHITTLE_JOBS", "4"}, {"WHITTLE_LOG_LEVEL", "error"}};
  const auto config = accepted({"--config", file.path(), "--jobs=5"}, environment);
  EXPECT_EQ(config.jobs, 5U);
  EXPECT_EQ(config.log_level, "error");
  EXPECT_EQ(config.render_wait_s, 7U);
}

TEST(Config, AcceptsFlagsWithDashesUnderscoresAndEqualsSigns) {
  EXPECT_EQ(accepted({"--render-wait-s", "9"}).render_wait_s, 9U);
  EXPECT_EQ(accepted({"--render_wait_s=9"}).render_wait_s, 9U);
  EXPECT_EQ(accepted({"--data=/tmp/a=b"}).data, "/tmp/a=b");
  EXPECT_EQ(accepted({"--assets=", "--jobs", "3"}).jobs, 3U);
}

TEST(Config, TreatsAnEmptyAssetDirectoryAsNone) {
  EXPECT_EQ(accepted({"--assets", "/srv/assets"}).assets, "/srv/assets");
  EXPECT_EQ(accepted({"--assets="}, {{"WHITTLE_ASSETS", "/srv/assets"}}).assets, "");
}

TEST(Config, ReportsAllErrorsOfAllSourcesWithTheirPlaces) {
  const TemporaryFile file("jobs = many\nno equals sign\ncolour = red\njobs = 2\n");
  const Environment environment{{"WHITTLE_LIGHTS", "-1"}};
  const std::string& at = file.path();
  const auto all =
      errors({"--config", at, "--listen", "0.0.0.0:1", "--bogus", "--log-level", "loud", "--drain-s"}, environment);
  EXPECT_EQ(places(all), "--bogus --drain-s " + at + ":2 " + at + ":3 " + at + ":4 " + at +
                             ":1 WHITTLE_LIGHTS --log-level --listen ");
}

TEST(Config, RejectsAddressesOfOtherMachinesWithoutKeys) {
  for (const char* address : {"0.0.0.0:8080", "192.168.1.2:8080", "[::]:8080", "8.8.8.8:1", "[2001:db8::1]:80"}) {
    expect_error({"--listen", address}, "--listen", "loopback");
    expect_error({"--health-listen", address}, "--health-listen", "loopback");
  }
}

TEST(Config, AcceptsAddressesOfOtherMachinesWithKeys) {
  EXPECT_EQ(accepted({"--listen", "0.0.0.0:80", "--keys", "file"}).listen, (whittled::Address{"0.0.0.0", 80}));
  EXPECT_EQ(accepted({"--health-listen", "[::]:80", "--keys", "file"}).health_listen, (whittled::Address{"::", 80}));
}

TEST(Config, AcceptsEveryLoopbackAddress) {
  EXPECT_EQ(accepted({"--listen", "127.5.6.7:0"}).listen, (whittled::Address{"127.5.6.7", 0}));
  EXPECT_EQ(accepted({"--listen", "[::1]:80"}).listen, (whittled::Address{"::1", 80}));
  EXPECT_EQ(accepted({"--listen", "localhost:80"}).listen, (whittled::Address{"127.0.0.1", 80}));
  EXPECT_EQ(accepted({"--listen", "127.0.0.1:0", "--health-listen", "127.0.0.1:0"}).health_listen.port, 0);
}

TEST(Config, RejectsNumbersOutsideTheRangeAndNamesIt) {
  for (const char* value : {"65", "-1", "1.5", "", "0x2", " 2", "99999999999999999999"}) {
    expect_error({"--jobs", value}, "--jobs", "0..64");
  }
}

TEST(Config, RejectsInvalidOptionsWithTheirPlaceAndReason) {
  const TemporaryFile large(std::string((1u << 20) + 1, '#'));
  struct Row {
    std::vector<std::string> arguments;
    const char *where, *part;
  };
  for (const auto& [arguments, where, part] : std::vector<Row>{
           {{"--listen", "8080"}, "--listen", "ADDRESS:PORT"},
           {{"--listen", "127.0.0.1:"}, "--listen", "port"},
           {{"--listen", "127.0.0.1:65536"}, "--listen", "port"},
           {{"--listen", "127.0.0.1:80x"}, "--listen", "port"},
           {{"--listen", "example.com:80"}, "--listen", "literal"},
           {{"--listen", "::1:80"}, "--listen", "brackets"},
           {{"--listen", "127.0.0.1:5000", "--health-listen", "127.0.0.1:5000"}, "health_listen", "differ"},
           {{"--jobs", "1", "--jobs", "2"}, "--jobs", "twice"},
           {{"--config", "/nonexistent/whittle.conf"}, "--config", "cannot read"},
           {{"--config", "/"}, "--config", "cannot read"},
           {{"--config", large.path()}, "--config", "1 MiB"},
           {{"--data", ""}, "--data", "empty"},
           {{"stray"}, "stray", "no option"},
           {{"-x"}, "-x", "no option"},
           {{"--jobs=3", "--drain-s"}, "--drain-s", "needs a value"},
           {{"--check-config=no"}, "--check-config", "takes no value"},
           {{"--check-config=false"}, "--check-config", "takes no value"},
           {{"--check-config=5"}, "--check-config", "takes no value"},
           {{"--check-config="}, "--check-config", "takes no value"},
           {{"--backup", ""}, "--backup", ""},
           {{"--new-key", "", "--keys", "file"}, "--new-key", "1 to 64"},
           {{"--scopes", "admin"}, "--scopes", "--new-key"},
       }) {
    expect_error(arguments, where, part);
  }
}

TEST(Config, GivesHelpAndVersionPrecedenceOverErrors) {
  for (const auto& [flag, task] : {std::pair("--help", Task::help), std::pair("--version", Task::version)}) {
    const auto command = whittled::read_command({"--bogus", flag}, {{"WHITTLE_NOTHING", "1"}});
    ASSERT_TRUE(command);
    EXPECT_EQ(command->task, task);
  }
}

TEST(Config, ListsUnknownVariablesButIgnoresThem) {
  const auto command = whittled::read_command({}, {{"WHITTLE_PORT", "tcp://10.0.0.1:80"}, {"WHITTLE_JOBS", "3"}});
  ASSERT_TRUE(command);
  EXPECT_EQ(command->unknown_variables, std::vector<std::string>{"WHITTLE_PORT"});
  EXPECT_EQ(command->config.jobs, 3U);
}

TEST(Config, AcceptsABackupDirectoryWithAnyListener) {
  const auto command = whittled::read_command({"--listen", "0.0.0.0:80", "--data", "here", "--backup", "there"}, {});
  ASSERT_TRUE(command);
  EXPECT_EQ(command->task, Task::backup);
  EXPECT_EQ(command->config.data, "here");
  EXPECT_EQ(command->backup, "there");
}

TEST(Config, ListsEveryOptionWithItsDefaultInTheHelp) {
  const std::string help = whittled::help_text();
  for (const auto& [name, value] : whittled::effective_settings(accepted({}))) {
    std::string flag = "--" + name;
    for (char& c : flag) c = c == '_' ? '-' : c;
    EXPECT_NE(help.find(flag + " "), std::string::npos) << flag;
    EXPECT_NE(help.find("(default " + (value.empty() ? "none" : value) + ")"), std::string::npos) << flag;
  }
}

}  // namespace
