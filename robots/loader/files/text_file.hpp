// Files that a user named, read whole. Each throws InputError with the path and the reason: no such
// file, a folder, no permission, a loop of links. Pipes, sockets and devices are refused, since
// they may never end.
#pragma once

#include <filesystem>
#include <string>

namespace kalmarm {

std::string read_text(const std::string& path);

// The same, also of /dev/stdin and /dev/fd/N, which a shell gives for <(COMMAND).
std::string read_text_or_stream(const std::string& path);

// False also of what cannot be looked at, where std::filesystem throws.
bool is_file(const std::filesystem::path& path);
bool is_folder(const std::filesystem::path& path);

// True where the name stands for something, or for something that cannot be looked at.
bool is_there(const std::filesystem::path& path);

}  // namespace kalmarm
