"""The ``rosz`` command.

`main` dispatches a command line by the table of `commands`. Each command group is one module: it
declares its commands (`declare`), parses, calls the library and prints (`console`, `call`).
`reading` reads sound command lines, `typer_app` all others and help, `complete` those that are
being typed. Programs that run ``rosz`` in their own process import `rosz.cli.main`.
"""

__all__: tuple[str, ...] = ()

PUBLIC_MODULES = ("main",)
