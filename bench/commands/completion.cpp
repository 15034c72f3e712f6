#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "bench/commands/commands.h"
#include "bench/commands/shell_completion.h"

namespace ricochet {
namespace {

// Both ask the program itself what may follow, so that they never grow old. It prints a word per line; none where the
// name of a file is expected.

const char* const kBash = R"sh(# Completion of ricochet for bash: source <(ricochet completion bash)
_ricochet() {
  local line=${COMP_LINE:0:COMP_POINT} words word
  read -ra words <<<"$line"
  [[ $line == *[[:space:]] ]] && words+=('')
  word=${words[-1]}
  mapfile -t COMPREPLY < <("$1" completion words -- "${words[@]:1}" 2>/dev/null)
  # Of a word with : or = bash replaces only what follows the last of them.
  if [[ $word == *[:=]* && $COMP_WORDBREAKS == *:* ]]; then
    local head=${word%"${word##*[:=]}"}
    COMPREPLY=("${COMPREPLY[@]#"$head"}")
  fi
  # NAME= goes on.
  if [[ ${COMPREPLY[0]} == *= ]]; then compopt -o nospace 2>/dev/null; fi
}
complete -o default -F _ricochet ricochet
)sh";

const char* const kZsh = R"sh(#compdef ricochet
# Completion of ricochet for zsh: source <(ricochet completion zsh), behind compinit; or a file _ricochet in $fpath
_ricochet() {
  local -a found
  found=(${(f)"$(${words[1]} completion words -- "${(@)words[2,CURRENT-1]}" "$PREFIX" 2>/dev/null)"})
  if (( $#found )); then
    compadd -S '' -- ${(M)found:#*=}  # NAME= goes on
    compadd -- ${found:#*=}
  else
    _files
  fi
}
if [[ $funcstack[1] == _ricochet ]]; then _ricochet "$@"; else compdef _ricochet ricochet; fi
)sh";

}  // namespace

void add_completion_command(CLI::App& app, int& /*exit_code*/) {
  static std::vector<std::string> line;
  auto* command = app.add_subcommand("completion", "print a script that completes commands and names in a shell");
  command->require_subcommand(1);
  command->add_subcommand("bash", "for bash")->callback([] { fmt::print("{}", kBash); });
  command->add_subcommand("zsh", "for zsh")->callback([] { fmt::print("{}", kZsh); });
  auto* words = command->add_subcommand("words", "called by the scripts")->group("");
  words->add_option("line", line, "words after the name of the program; the last one is completed");
  words->callback([&app] {
    for (const auto& word : completions(app, line)) fmt::print("{}\n", word);
  });
  command->footer("Example:\n  source <(ricochet completion bash)");
}

}  // namespace ricochet
