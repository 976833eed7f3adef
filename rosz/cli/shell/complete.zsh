if [[ -o interactive ]]; then
(( $+functions[compdef] )) || { autoload -Uz compinit && compinit -u -D; }
_rosz_complete() {
  local line="${(j: :)words[1,CURRENT-1]} $PREFIX"
  local -a found ended
  found=(${(f)"$("$ROSZ_PYTHON" -P -m rosz complete zsh "$line" 2>/dev/null)"})
  ended=(${found:#*[/=]})
  found=(${(M)found:#*[/=]})
  (( $#ended )) && compadd -Q -a ended
  (( $#found )) && compadd -Q -S '' -a found
}
compdef _rosz_complete @names@
fi
