# shellcheck shell=bash
# Completes commands, flags and their listed values for the programs of Hairnet, as their --help has them; elsewhere file names.
#   source deploy/completion.bash      for programs that are not installed
_hairnet() {
  local current=${COMP_WORDS[COMP_CWORD]} before=$((COMP_CWORD - 1)) help commands word words
  # Bash makes three words of --flag=value.
  if [ "$current" = = ]; then
    current=''
  elif [ "${COMP_WORDS[before]}" = = ]; then
    before=$((before - 1))
  fi
  COMPREPLY=()
  help=$("$1" --help 2>/dev/null) || return 0
  commands=$(sed -n '/^Subcommands:$/,/^$/s/^  \([a-z][^ ]*\).*/\1/p' <<<"$help")
  for word in "${COMP_WORDS[@]:1:COMP_CWORD-1}"; do
    [ "$word" != -- ] || return 0   # the words after it are another program's
    if grep -qxF -e "$word" <<<"$commands"; then
      help=$("$1" "$word" --help 2>/dev/null)
      commands=''
    fi
  done
  if [[ $current == -* ]]; then
    words=$(sed -nE 's/^ +(-[^ {]*).*/\1/p' <<<"$help" | tr , '\n')
  else
    # A line names a flag, or several with commas, and shows {its,values}.
    words=$(awk -v flag="${COMP_WORDS[before]}" '
      /^ +-/ && index("," $1 ",", "," flag ",") && match($0, /\{[^}]*\}/) { print substr($0, RSTART + 1, RLENGTH - 2); exit }
      ' <<<"$help" | tr , '\n')
    [ -n "$words" ] || words=$commands
  fi
  mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current")
}
complete -o default -F _hairnet hairnet-{server,view,groom,sim,token,load,fleet-plan}
