import type { ScenarioDocument } from "../api/types";

/** Documents that are kept to be shown again at once; what they share is kept once. */
const MOST = 50;

/** The documents that this page has seen follow one another: where undo and redo lead, if it knows. */
export class Timeline {
  private documents: ScenarioDocument[] = [];
  private at = -1;

  /** Begins anew, with a document of which is not known what came before. */
  begin(document: ScenarioDocument): void {
    this.documents = [document];
    this.at = 0;
  }

  /** An edit was made: what could be made again is forgotten. */
  grow(document: ScenarioDocument): void {
    this.documents = [...this.documents.slice(0, this.at + 1), document].slice(-MOST);
    this.at = this.documents.length - 1;
  }

  /** The document so many steps back (negative) or forth; null beyond what is known. */
  look(steps: number): ScenarioDocument | null {
    return this.documents[this.at + steps] ?? null;
  }

  /** Undo (-1) or redo (+1) was made, and has led to a document. */
  move(step: number, document: ScenarioDocument): void {
    if (this.look(step) === null) this.begin(document);
    else {
      this.at += step;
      this.documents[this.at] = document;
    }
  }
}
