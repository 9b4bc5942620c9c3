/// The command line of the worker, written by the daemon and parsed by the worker.

#include <gtest/gtest.h>

#include "server/worker/protocol/worker_options.h"

using worker::arguments_of;
using worker::Options;
using worker::parse_options;

TEST(WorkerOptions, RoundTrip) {
  const Options options{7,          3,      1ull << 41,
                        1ull << 42, 12'345, {"/a directory/with = and --slots", "/uploads", 123, 1ull << 40}};
  const std::vector<std::string> arguments = arguments_of(options);
  EXPECT_EQ(parse_options({arguments.begin(), arguments.end()}), options);
  const std::vector<std::string> plain = arguments_of({});
  EXPECT_EQ(parse_options({plain.begin(), plain.end()}), Options{});
}

TEST(WorkerOptions, RejectsInvalidArguments) {
  using Arguments = std::vector<std::string_view>;
  for (const Arguments& arguments :
       {Arguments{}, Arguments{"--slots"}, Arguments{"--slots", "0"}, Arguments{"--slots", "4097"},
        Arguments{"--slots", "-1"}, Arguments{"--slots", "2x"}, Arguments{"--slots", ""}, Arguments{"--help", "2"},
        Arguments{"--slots", "2", "--assets"}, Arguments{"--objects", "-1"}, Arguments{"--triangles", "1e6"},
        Arguments{"--threads", "-1"}, Arguments{"--threads", "1025"}, Arguments{"--scene-cache", "1.5"}}) {
    EXPECT_EQ(parse_options(arguments), std::nullopt) << testing::PrintToString(arguments);
  }
}
