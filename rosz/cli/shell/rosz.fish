set -gx ROSZ_PYTHON @python@
contains @folder@ $PATH; or set -gx PATH @folder@ $PATH @absent@
contains @modules@ $PYTHONPATH; or set -gx --path PYTHONPATH $PYTHONPATH @modules@
function roscd
    set -l parts (string split -m 1 / "$argv[1]")
    set -l folder ($ROSZ_PYTHON -P -m rosz pkg find "$parts[1]"); and cd "$folder/$parts[2]"
end
function __rosz_complete
    $ROSZ_PYTHON -P -m rosz complete fish (commandline -cp | string collect) 2>/dev/null
end
for command in @names@
    complete -c $command -f -a "(__rosz_complete)"
end
