"""Options that hide faults in the drive behind a virtual board, and tell afterwards which."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from edge_ident import commissioning, report
from edge_ident.cli.options import ResultOptions

if TYPE_CHECKING:
    from edge_ident.commissioning import Hidden


@dataclass(frozen=True)
class HideOptions:
    """What is wrong with the drive behind a virtual board."""

    hide: Annotated[
        list[str] | None,
        typer.Option(
            "--hide",
            metavar="NAME[=SIZE]",
            help="Hide a fault in the virtual drive, such as backlash=0.01; may be repeated. "
            "An unknown name, as in --hide list, lists all faults.",
        ),
    ] = None
    axis: Annotated[
        Literal["x", "z"] | None,
        typer.Option(
            "--axis", help="Axis that has the faults; default: x, or a random one with --hide-seed."
        ),
    ] = None
    hide_seed: Annotated[
        int | None,
        typer.Option(
            "--hide-seed",
            metavar="NUMBER",
            min=0,
            help="Hide one or two random faults; the same number hides the same ones. With "
            "--hide: choose only the details at random.",
        ),
    ] = None
    used: Annotated[
        int | None,
        typer.Option(
            "--used",
            metavar="NUMBER",
            min=0,
            help="Use a random used machine as the virtual drive: a dozen things are slightly "
            "wrong on it. The same number gives the same machine.",
        ),
    ] = None
    wear: Annotated[
        float | None,
        typer.Option(
            "--wear",
            metavar="LEVEL",
            min=0.0,
            max=3.0,
            help="Wear of the machine of --used: 0 like new, 1 used, 2 worn; default: 1.",
        ),
    ] = None
    friction: Annotated[
        Literal["lugre", "dahl"] | None,
        typer.Option(
            "--friction",
            help="Make the machine of --used like new, simulated by another program with this "
            "friction model.",
        ),
    ] = None
    reveal: Annotated[
        bool,
        typer.Option("--reveal", help="Print at the end what these options have hidden."),
    ] = False

    def hidden(self, *, of_machine: bool = False) -> "Hidden | None":
        """What is to be hidden, in the machine alone where the board is another; None: nothing."""
        if self.used is not None:
            return self._used(self.used)
        for missing, option in ((self.wear, "--wear"), (self.friction, "--friction")):
            if missing is not None:
                raise typer.BadParameter("give --used, too", param_hint=option)
        if not self.hide and self.hide_seed is None:
            for given, option in ((self.axis, "--axis"), (self.reveal, "--reveal")):
                if given:
                    raise typer.BadParameter(
                        "nothing is hidden: give --hide, --hide-seed or --used, too",
                        param_hint=option,
                    )
            return None
        if not self.hide:
            return commissioning.Hidden.drawn(self.hide_seed or 0, self.axis, of_machine=of_machine)
        try:
            return commissioning.Hidden.of(
                self.hide, self.axis or "x", self.hide_seed or 0, of_machine=of_machine
            )
        except ValueError as error:
            raise typer.BadParameter(str(error), param_hint="--hide") from error

    def _used(self, seed: int) -> "Hidden":
        """The machine of this number."""
        if self.hide or self.hide_seed is not None or self.axis:
            raise typer.BadParameter(
                "faults are hidden in the documented drive: give either these or --used",
                param_hint="--used",
            )
        if self.friction is None:
            return commissioning.Hidden.used(seed, 1.0 if self.wear is None else self.wear)
        if self.wear is not None:
            raise typer.BadParameter("with --friction the machine is clean", param_hint="--wear")
        return commissioning.Hidden.rubbing(seed, self.friction)

    def add_to(self, document: dict[str, Any], hidden: "Hidden | None") -> None:
        """Put the truth into a document, if it is asked for."""
        if self.reveal and hidden:
            document["hidden"] = report.fault_documents(hidden.faults)

    def tell_alone(
        self,
        command: str,
        document: dict[str, Any],
        hidden: "Hidden | None",
        results: ResultOptions,
    ) -> None:
        """Print the truth of a command that would serve something, and serve nothing."""
        document = {"schema": f"edge-ident/{command}/1", **document}
        self.add_to(document, hidden)
        results.deliver(document, f"{command}.json")
        if not results.json:
            self.tell(hidden)

    def tell(self, hidden: "Hidden | None") -> None:
        """Print the truth, if it is asked for."""
        if self.reveal and hidden:
            for line in report.fault_lines(hidden.faults):
                print(line, flush=True)
