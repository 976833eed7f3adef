if [[ $- = *i* ]]; then
_rosz_complete() {
  local line="${COMP_LINE:0:COMP_POINT}"
  mapfile -t COMPREPLY < <("$ROSZ_PYTHON" -P -m rosz complete bash "$line" 2>/dev/null)
  [[ ${#COMPREPLY[@]} = 1 && $COMPREPLY = *[/=] ]] && compopt -o nospace
  return 0
}
complete -F _rosz_complete @names@
fi
