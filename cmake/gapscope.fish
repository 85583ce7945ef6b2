# fish completion for gapscope. Asks the program itself, so it never falls behind it.

# The help of the command that the words before the cursor name: "design", then "chirp".
function __gapscope_help
    set -l words (commandline -opc)
    set -l program $words[1]
    set -l path
    set -l help ($program --help 2>/dev/null)
    for word in $words[2..-1]
        string match -qr "^  $(string escape --style=regex -- $word) " -- (__gapscope_commands $help) || break
        set -a path $word
        set help ($program $path --help 2>/dev/null)
    end
    string join \n -- $help
end

# The lines of a help that name commands.
function __gapscope_commands
    set -l inside 0
    for line in $argv
        test -z "$line"; and set inside 0
        test $inside = 1; and string match -r '^  [a-z][a-z-]* .*' -- $line
        test "$line" = 'Subcommands:'; and set inside 1
    end
end

# "free_run" ... where the word before the cursor is an option that takes one of a set: "--mode {free_run,windows}".
function __gapscope_choices
    set -l previous (commandline -opc)[-1]
    set -l set (string match -rg "^  $(string escape --style=regex -- $previous) [A-Z:]*\{([^}]*)\}" -- $argv)
    string split , -- $set
end

# A word a line, with what it means where the help says so on the same line; files where none is known.
function __gapscope_words
    set -l help (__gapscope_help)
    set -l choices (__gapscope_choices $help)
    set -l commands (__gapscope_commands $help)
    if test -n "$choices"
        string join \n -- $choices
    else if string match -q -- '-*' (commandline -ct); or test -n "$commands"
        string replace -rf '^  ([a-z][a-z-]*) +(.*)' '$1\t$2' -- $commands
        string replace -rf '^  (?:-h,)?(--[a-z0-9-]+)(?: +(?:\S+ )*? +(.*))?.*' '$1\t$2' -- $help
    else
        __fish_complete_path (commandline -ct)
    end
end

complete -c gapscope -f -a '(__gapscope_words)'
