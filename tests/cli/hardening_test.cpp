// What the built program offers to whoever finds a fault in it, read from its file.
#include <elf.h>
#include <gtest/gtest.h>

#include <cstring>

#include "program.hpp"
#include "whirl/testing/compiled.hpp"

namespace whirl::testing {
namespace {

TEST(HardeningE2e, TheProgramLoadsAnywhereAndItsTablesAreReadOnly) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "a build for tests only";
#endif
  const std::string file = slurp(program());
  ASSERT_GT(file.size(), sizeof(Elf64_Ehdr));
  Elf64_Ehdr head;
  std::memcpy(&head, file.data(), sizeof head);
  ASSERT_EQ(std::memcmp(head.e_ident, ELFMAG, SELFMAG), 0);
  ASSERT_EQ(head.e_ident[EI_CLASS], ELFCLASS64);
  EXPECT_EQ(head.e_type, ET_DYN) << "no position-independent program";
  bool relro = false, stack = false, now = false, pie = false;
  for (int i = 0; i < head.e_phnum; ++i) {
    Elf64_Phdr part;
    std::memcpy(&part, file.data() + head.e_phoff + static_cast<std::size_t>(i) * sizeof part, sizeof part);
    EXPECT_FALSE(part.p_type == PT_LOAD && (part.p_flags & PF_W) && (part.p_flags & PF_X)) << "written and run";
    relro = relro || part.p_type == PT_GNU_RELRO;
    stack = stack || (part.p_type == PT_GNU_STACK && !(part.p_flags & PF_X));
    if (part.p_type != PT_DYNAMIC) continue;
    for (std::size_t at = 0; at < part.p_filesz; at += sizeof(Elf64_Dyn)) {
      Elf64_Dyn entry;
      std::memcpy(&entry, file.data() + part.p_offset + at, sizeof entry);
      if (entry.d_tag == DT_FLAGS) now = now || (entry.d_un.d_val & DF_BIND_NOW);
      if (entry.d_tag == DT_FLAGS_1) now = now || (entry.d_un.d_val & DF_1_NOW), pie = entry.d_un.d_val & DF_1_PIE;
    }
  }
  EXPECT_TRUE(relro) << "RELRO";
  EXPECT_TRUE(now) << "BIND_NOW";
  EXPECT_TRUE(pie) << "PIE";
  EXPECT_TRUE(stack) << "a stack that is not run";
  // What reads files, sockets and wires ends at a smashed stack and at a copy beyond its buffer.
  EXPECT_NE(file.find("__stack_chk_fail"), std::string::npos) << "stack protector";
  EXPECT_TRUE(file.find("__memcpy_chk") != std::string::npos || file.find("__snprintf_chk") != std::string::npos ||
              file.find("__read_chk") != std::string::npos)
      << "fortified copies";
}

// The tool of Debian, and the flags that a package is built with.
TEST(HardeningE2e, HardeningCheckFindsEveryGuardAndPackagesAskForAll) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "a build for tests only";
#endif
  EXPECT_NE(slurp(source_dir() + "/debian/rules").find("\nexport DEB_BUILD_MAINT_OPTIONS = hardening=+all\n"),
            std::string::npos);
  if (!has_program("hardening-check")) GTEST_SKIP() << "hardening-check (devscripts) is not installed";
  const Folder folder;
  const auto check = shell(folder / "", "LC_ALL=C hardening-check " + program());
  for (const char* guard :
       {"Position Independent Executable: yes", "Stack protected: yes", "Fortify Source functions: yes",
        "Read-only relocations: yes", "Immediate binding: yes", "Stack clash protection: yes"})
    EXPECT_NE(check.text.find(guard), std::string::npos) << guard << " in:\n" << check.text;
}

}  // namespace
}  // namespace whirl::testing
