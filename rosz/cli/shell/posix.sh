export ROSZ_PYTHON=@python@
case ":$PATH:" in *:@folder@:*) ;; *) export PATH=@folder@:"$PATH":@absent@ ;; esac
case ":${PYTHONPATH-}:" in
  *:@modules@:*) ;;
  *) export PYTHONPATH="${PYTHONPATH:+$PYTHONPATH:}"@modules@ ;;
esac
unalias roscd 2>/dev/null
roscd() {
  local package="${1%%/*}" folder
  folder="$("$ROSZ_PYTHON" -P -m rosz pkg find "$package")" && cd "$folder${1#"$package"}"
}
