#pragma once
/// The content of an open file.

#include <gtest/gtest.h>
#include <unistd.h>

#include <string>

#include "server/support/descriptor.h"

inline std::string text_of(const support::Descriptor& file) {
  std::string text(static_cast<std::size_t>(lseek(file.get(), 0, SEEK_END)), '\0');
  EXPECT_EQ(pread(file.get(), text.data(), text.size(), 0), static_cast<ssize_t>(text.size()));
  return text;
}
